"""What the README says can be done, done."""
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / 'README.md').read_text(encoding='utf-8')
EXAMPLES = re.findall(r'```python\n(.*?)```', README, re.DOTALL)


@pytest.mark.parametrize('example', EXAMPLES, ids=lambda text: text.splitlines()[-1][:30])
def test_each_example_of_the_library_runs(example, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    exec(compile(example, 'README.md', 'exec'), {})
    assert capsys.readouterr().out


def test_every_file_that_the_readme_names_is_there():
    named = set(re.findall(r'(?:config|docs|benchmark|launch|mobile_planning)/[\w/]+\.\w+', README))
    assert len(named) > 8
    assert [name for name in sorted(named) if not (ROOT / name).exists() and not name.endswith('_msgs/srv')] == []


def test_every_parameter_that_the_readme_lists_is_one_of_a_node():
    nodes = '\n'.join(path.read_text() for path in (ROOT / 'mobile_planning/nodes').glob('*.py'))
    table = README.split('| parameter |')[1].split('\n\n')[0]
    parameters = [name for row in table.splitlines()[2:] for name in re.findall(r'`(\w+)`', row.split('|')[1])]
    assert len(parameters) > 20
    assert [name for name in parameters if not re.search(rf'^    {name}: .*option\(', nodes, re.MULTILINE)
            and name not in ('robot', 'world_sim', 'map_server', 'grid_planner')] == []
