"""What a mission leaves behind: a report that any JSON reader takes, and a picture of it."""
import json

import numpy as np
import pytest
from PIL import Image

from mobile_planning import (
    Boundary, Environment, InvalidInput, OccupancyGrid, PolygonObstacle, RoundObstacle, verify)
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body
from mobile_planning.outcome import film_mission, write_outcome

FIELDS = {'valid': bool, 'robots': int, 'arrived': int, 'min_separation': float, 'min_obstacle_clearance': float,
          'mission_time': float, 'violations': list}
ROOM = Environment(Boundary((0, 10), (0, 6)), [RoundObstacle((5, 1), 0.5), PolygonObstacle([(4, 5), (6, 5), (5, 6)])])


def drive(y, count=20):
    along = np.cumsum([0, 0, 0, 0.1, 0.2, *[0.25] * count, 0.2, 0.1, 0, 0])
    return Plan(0, 0.25, np.column_stack([1 + along, np.full(len(along), y)]))


def body(eyed, plan):
    return Body(eyed, 0.2, np.array([*plan.points[0], 0.0]), np.array([*plan.end, 0.0]), 1.0, 5.0, 2.0)


def leave(folder, plans, world=ROOM, solved=None):
    """Judge the plans by robot id, write what comes of it, and return (report, JSON, image)."""
    bodies = [body(eyed, plan) for eyed, plan in plans.items()]
    solutions = {eyed: Solution(eyed, (plans[eyed],), True) for eyed in (plans if solved is None else solved)}
    report = verify(solutions, bodies, world)
    paths = write_outcome(folder, report, solutions, bodies, world)
    assert paths == (folder / 'report.json', folder / 'mission.png')

    def refuse(constant):
        raise AssertionError(f'{constant} is not JSON')
    return report, json.loads(paths[0].read_text(), parse_constant=refuse), Image.open(paths[1]).convert('RGB')


def is_drawn(image):
    """Return whether a picture has a frame, text and several colours on its white."""
    pixels = np.asarray(image)
    share = (pixels < 250).any(axis=2).mean()
    return min(image.size) > 100 and 0.005 < share < 0.95 and len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20


def test_the_report_has_its_fields_and_the_picture_is_drawn(tmp_path):
    report, content, image = leave(tmp_path / 'deep' / 'out', {1: drive(2.0), 7: drive(4.0)})
    assert report.valid and is_drawn(image)
    for name, kind in FIELDS.items():
        assert isinstance(content[name], kind) and content[name] == getattr(report, name)
    assert content['min_separation'] == pytest.approx(2.0) and content['closest']['robots'] == [1, 7]


def test_what_went_wrong_is_in_the_report(tmp_path):
    _, content, image = leave(tmp_path, {1: drive(2.0), 2: drive(2.2)})
    assert not content['valid'] and len(content['violations']) == 2
    assert all('robots 1 and 2' in sentence for sentence in content['violations'])
    assert is_drawn(image)


def test_a_robot_without_a_solution_is_drawn_at_its_start(tmp_path):
    _, content, image = leave(tmp_path, {1: drive(2.0), 2: drive(4.0)}, solved=[1])
    assert (content['arrived'], content['robots'], content['valid']) == (1, 2, False) and is_drawn(image)


def test_one_robot_has_no_separation_and_json_no_infinity(tmp_path):
    _, content, image = leave(tmp_path, {3: drive(3.0)})
    assert content['valid'] and content['min_separation'] is None and content['closest'] is None and is_drawn(image)


@pytest.mark.parametrize('yaw', [0.0, 0.5])
def test_a_mission_on_a_map_is_drawn_on_it(tmp_path, yaw):
    data = np.zeros((120, 160), np.int8)
    data[:10], data[100:, 50:60] = 100, -1
    world = Environment(grid=OccupancyGrid(data, 0.1, (-1.0, -2.0, yaw)))
    _, content, image = leave(tmp_path, {1: drive(3.0, 4)}, world)
    assert content['min_obstacle_clearance'] > 0 and is_drawn(image)


def test_many_robots_share_the_colours(tmp_path):
    assert is_drawn(leave(tmp_path, {index: drive(0.5 + 0.5 * index) for index in range(1, 11)})[2])


def test_an_old_outcome_is_replaced(tmp_path):
    leave(tmp_path, {1: drive(2.0), 2: drive(2.2)})
    assert leave(tmp_path, {1: drive(2.0)})[1]['robots'] == 1


def test_a_folder_that_cannot_be_made_is_an_error_of_the_system(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(OSError):
        leave(tmp_path / 'file' / 'out', {1: drive(2.0)})


# Films


def film(path, plans):
    bodies = [body(eyed, plan) for eyed, plan in plans.items()]
    solutions = {eyed: Solution(eyed, (plan,), True) for eyed, plan in plans.items()}
    film_mission(verify(solutions, bodies, ROOM), solutions, bodies, ROOM, path)
    return Image.open(path)


def test_a_film_shows_the_robots_on_their_ways(tmp_path):
    made = film(tmp_path / 'new' / 'mission.gif', {1: drive(2.0), 2: drive(4.0)})
    frames = []
    for index in (0, made.n_frames // 2, made.n_frames - 1):
        made.seek(index)
        frames.append(np.asarray(made.convert('RGB'), int))
    assert made.n_frames > 50 and is_drawn(made.convert('RGB'))
    # Robot 1 is the only thing that blue and that high: it comes from the left and goes to the right.
    columns = [np.flatnonzero((abs(frame - (0, 0x72, 0xB2)).sum(axis=2) < 60).sum(axis=0) > 6) for frame in frames]
    assert columns[0].max() + 30 < columns[1].min() and columns[1].max() + 30 < columns[2].min()


@pytest.mark.parametrize('name', ['mission.avi', 'mission', 'gif'])
def test_a_film_of_another_kind_is_refused(tmp_path, name):
    with pytest.raises(InvalidInput, match='gif'):
        film(tmp_path / name, {1: drive(2.0)})
