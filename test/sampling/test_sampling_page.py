"""What docs/sampling.md says of the documents' names is so, and its examples run."""
import importlib
import re
from pathlib import Path

import pytest

from mobile_planning import RRT, Edge, Node, PRMPlanner

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs' / 'sampling.md').read_text(encoding='utf-8')
#: The index of both documents.
NAMES = '''RRT Edge Node node_from node_to path cost position time destination_list nodes edges environment goal_rate
precision goal root local_planner set_start run in_goal_region select_options select_best_edge children_count
delete_all_children plot plot_tree PRMPlanner BRUTE_FORCE PARTIAL_INDEX_TABLE KDTREE LAZY NODECHECK FULL A_STAR DIJKSTRA
buildRoadmap setNeighborCount setNeighSearchStrategy setPartialIndexTableDimensions setCollisionCheckingStrategy
setShortestPathSearchStrategy setAStarTimeOutTime printTimeStats query getProperties constraint sampler resolution'''


@pytest.mark.parametrize('name', NAMES.split())
def test_every_name_of_the_documents_is_on_the_page(name):
    code = ' '.join(re.findall(r'`([^`]*)`', PAGE.split('## Every name')[1]))
    assert re.search(rf'(?<!\w){re.escape(name)}(?!\w)', code)


def test_every_file_that_the_page_names_is_there():
    named = set(re.findall(r'`(sampling/\w+\.py)`', PAGE))
    assert len(named) > 8
    assert [name for name in sorted(named) if not (ROOT / 'mobile_planning' / name).exists()] == []


def test_every_test_that_the_page_names_is_there():
    there = ''.join(path.read_text(encoding='utf-8') for path in Path(__file__).parent.glob('test_*.py'))
    named = set(re.findall(r'`(test_\w+)`', PAGE))
    assert len(named) > 20
    assert [name for name in sorted(named) if f'def {name}(' not in there] == []


def test_every_method_of_the_documents_is_there():
    for name in ('set_start run in_goal_region select_options select_best_edge children_count delete_all_children plot '
                 'nodes edges environment root drive advance prune').split():
        assert hasattr(RRT, name), name
    # As the original writes it, in snake case.
    for name in re.findall(r'\b(?:build|set|print)[A-Z]\w+', PAGE.split('## Every name')[1]):
        assert callable(getattr(PRMPlanner, re.sub('([A-Z])', r'_\1', name).lower()))
    assert Node((1, 2, 3), 4, 5).destination_list == [] and Edge((0, 0), (1, 1), [(0, 0), (1, 1)], 2).cost == 2


@pytest.mark.parametrize('name', sorted(set(re.findall(r'`([a-z_]+)` in `sampling/(\w+)\.py`', PAGE))))
def test_what_the_page_says_is_in_a_file_is_in_it(name):
    assert hasattr(importlib.import_module(f'mobile_planning.sampling.{name[1]}'), name[0])


def test_the_examples_of_the_page_print_what_they_say(capsys):
    space = {}
    for example, said in re.findall(r'```python\n(.*?)```\n\n```\n(.*?)```', PAGE, re.DOTALL):
        exec(compile(example, 'sampling.md', 'exec'), space)
        assert capsys.readouterr().out == said
