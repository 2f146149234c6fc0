"""What the README and the pages beside it say can be done, done; and what they name is there."""
import re
from pathlib import Path

import pytest

from mobile_planning.fleet import scenarios
from mobile_planning.fleet.scene_file import load_scene

ROOT = Path(__file__).resolve().parent.parent
PAGES = {path.name: path.read_text(encoding='utf-8') for path in (ROOT / 'README.md', *(ROOT / 'docs').glob('*.md'))}
README, NODES, FLEET = (PAGES[name] for name in ('README.md', 'nodes.md', 'fleet.md'))
EXAMPLES = re.findall(r'```python\n(.*?)```', README, re.DOTALL)
#: Where the parameters of each node are declared.
OPTIONS = {'map_server': 'map_server', 'grid_planner': 'grid_planner_options',
           'sampling_planner': 'sampling_planner_options', 'robot': 'robot_options',
           'world_sim': 'world_sim_options'}


@pytest.mark.parametrize('example', EXAMPLES, ids=lambda text: text.splitlines()[-1][:30])
def test_each_example_of_the_library_runs(example, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    exec(compile(example, 'README.md', 'exec'), {})
    assert capsys.readouterr().out


@pytest.mark.parametrize('name', PAGES)
def test_every_file_that_a_page_names_is_there(name):
    named = set(re.findall(r'(?:config|benchmark|launch|mobile_planning|msg_defs|docs)/[\w/]+\.\w+', PAGES[name]))
    linked = {(ROOT / ('' if name == 'README.md' else 'docs') / link).resolve()
              for link in re.findall(r'\]\((?!https?:)([^)#]+)\)', PAGES[name])}
    assert [each for each in named if not (ROOT / each).exists()] == []
    assert [each for each in linked if not each.exists()] == []


def test_the_readme_leads_to_every_page():
    assert [name for name in PAGES if name != 'README.md' and f'(docs/{name})' not in README] == []


def parameters(node):
    """Return the parameters that the table gives a node."""
    table = NODES.split('| parameter |')[1].split('\n\n')[0]
    part = re.search(rf'\| \*\*{node}\*\*(.*?)(\n\| \*\*|\Z)', table, re.DOTALL)[1]
    return {name for row in part.splitlines() for name in re.findall(r'`(\w+)`', row.removeprefix('|').split('|')[0])}


@pytest.mark.parametrize('node', OPTIONS)
def test_the_table_has_exactly_the_parameters_of_each_node(node):
    source = (ROOT / 'mobile_planning' / 'nodes' / f'{OPTIONS[node]}.py').read_text()
    declared = set(re.findall(r'^    (\w+): .*= option\(', source, re.MULTILINE))
    assert len(declared) >= 6
    assert parameters(node) == declared


def test_every_topic_and_service_of_the_table_of_nodes_is_in_their_code():
    code = '\n'.join(path.read_text() for path in (ROOT / 'mobile_planning' / 'nodes').glob('*.py'))
    table = NODES.split('## Topics and services')[1].split('\n\n')[1]
    named = set(re.findall(r'`(~?/\w+)`', table))
    words = {name.split('/')[1] for name in named} - {'map_metadata'}
    assert len(named) > 25 and [word for word in sorted(words) if not re.search(rf"['/]{word}'", code)] == []


def test_every_shipped_scene_is_named_and_can_be_read():
    shipped = {path.stem for path in (ROOT / 'config' / 'fleets').glob('*.yaml')}
    table = FLEET.split('| `config/fleets/` |')[1].split('\n\n')[0]
    assert set(re.findall(r'`(\w+)`', ''.join(row.split('|')[1] for row in table.splitlines()[1:]))) == shipped
    for name in shipped:
        assert load_scene(ROOT / 'config' / 'fleets' / f'{name}.yaml').robots


def test_every_family_is_named_and_the_example_of_a_scene_can_be_read(tmp_path):
    assert [family for family in scenarios.families() if f'`{family}`' not in FLEET] == []
    (text,) = re.findall(r'```yaml\n(.*?)```', FLEET, re.DOTALL)
    scene = tmp_path / 'scene.yaml'
    scene.write_text(text.replace('../maps', str(ROOT / 'config' / 'maps')))
    assert [spec.id for spec in load_scene(scene).robots] == [1, 2]
