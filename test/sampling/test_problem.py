"""Problem files."""
import json
from pathlib import Path

import numpy as np
import pytest

from mobile_planning import InvalidInput, load_problem

FOLDER = Path(__file__).resolve().parent.parent / 'data' / 'sampling'
GOOD = {'format': 1, 'name': 'n', 'kind': 'dubins', 'bounds': [0, 0, 9, 9], 'obstacles': [], 'start': [1, 1, 0],
        'goal': [8, 8, 0], 'turning_radius': 1.0}


def written(tmp_path, **changes):
    path = tmp_path / 'problem.json'
    path.write_text(json.dumps({key: value for key, value in {**GOOD, **changes}.items() if value is not None}))
    return path


@pytest.mark.parametrize('path', sorted(FOLDER.glob('*.json')), ids=lambda path: path.stem)
def test_start_and_goal_of_every_problem_are_free(path):
    problem = load_problem(path)
    assert problem.name == path.stem
    assert len(problem.start) == len(problem.goal) == {'dubins': 3, 'holonomic': 2}[problem.kind]
    assert problem.environment.free_poses([problem.start, problem.goal]).all()
    assert problem.best_known['cost'] > np.hypot(*np.subtract(problem.goal, problem.start)[:2])
    for query in problem.queries:
        assert problem.environment.free_poses([query.start, query.goal]).all() and query.cost > 0


def test_moving_obstacles_move():
    problem = load_problem(FOLDER / 'gap_walls_5_moving.json')
    assert len(problem.environment.moving) == 10
    # The first gap ends at x = 76.35 + 0.074 t.
    assert not problem.environment.free_poses((76.5, 10, 0), 0.0)
    assert problem.environment.free_poses((76.5, 10, 0), 10.0)


@pytest.mark.parametrize('changes', [
    {'format': 2}, {'kind': 'flying'}, {'start': None}, {'start': [1, 1]}, {'goal': [1, 1, 'x']}, {'bounds': [0, 0, 9]},
    {'bounds': [0, 9, 9, 0]}, {'turning_radius': -1}, {'turning_radius': None}, {'speed': 0}, {'expect': 'maybe'},
    {'obstacles': [{'type': 'blob'}]}, {'obstacles': [{'type': 'circle', 'center': [1, 1]}]},
    {'obstacles': [{'type': 'circle', 'center': [1, 1], 'radius': -1}]}])
def test_what_is_wrong_in_a_file_is_named(tmp_path, changes):
    with pytest.raises(InvalidInput, match='problem.json'):
        load_problem(written(tmp_path, **changes))


def test_a_file_that_is_no_json_is_refused(tmp_path):
    path = tmp_path / 'problem.json'
    path.write_text('{')
    with pytest.raises(InvalidInput):
        load_problem(path)
    with pytest.raises(OSError):
        load_problem(tmp_path / 'missing.json')
