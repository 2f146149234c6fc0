"""Course: where it ends, and what counts as progress on it."""
import numpy as np
import pytest
from missions import SWAP, robot

from mobile_planning import GoalOccupied, NoPath, PolygonObstacle


def course():
    return robot(1, *SWAP[0])._course


def test_it_ends_within_two_centimetres_and_two_hundredths_of_a_radian():
    one = course()
    assert one.ends_at(np.array([9.019, 3.0])) and not one.ends_at(np.array([9.015, 3.015]))
    assert one.ends_towards(2 * np.pi - 0.019) and not one.ends_towards(0.021)


@pytest.mark.parametrize('nearer, is_progress', [(0.0, False), (0.04, False), (0.06, True), (-1.0, False)])
def test_only_getting_nearer_by_more_than_five_centimetres_is_progress(nearer, is_progress):
    one = course()
    one.note_progress(np.array([2.0, 3.0]), 1.0)
    one.note_progress(np.array([2.0 + nearer, 3.0]), 2.0)
    assert one.progress_at == (2.0 if is_progress else 1.0)


def test_who_creeps_makes_progress_in_the_end():
    one = course()
    for step in range(10):
        one.note_progress(np.array([2.0 + 0.02 * step, 3.0]), float(step))
    assert one.progress_at == 9.0


def test_who_was_led_away_counts_from_there():
    one = course()
    one.note_progress(np.array([8.0, 3.0]), 1.0)
    one.count_anew(np.array([2.0, 3.0]), 2.0)
    one.note_progress(np.array([2.1, 3.0]), 3.0)
    assert one.progress_at == 3.0


def test_a_crowd_ahead_makes_a_roundabout_and_an_empty_room_none():
    agent = robot(1, *SWAP[0])
    others = [robot(index + 2, (5 + 3 * np.cos(angle), 3 + 2 * np.sin(angle), 0),
                    (5 - 3 * np.cos(angle), 3 - 2 * np.sin(angle), 0))
              for index, angle in enumerate(np.linspace(0.0, 2 * np.pi, 8, endpoint=False))]
    agent.join([agent.eyed, *(other.eyed for other in others)])
    agent._course.look_around(np.array([1.0, 3.0]), [])
    assert agent._course._roundabout is None
    for other in others:
        agent.receive(other.step(0.0)[0], 0.0)
    agent._course.look_around(np.array([1.0, 3.0]), agent._motion.surroundings.neighbours(1))
    assert np.linalg.norm(agent._course._roundabout.centre - (5, 3)) < 1.5


def test_a_course_to_nowhere_is_none():
    wall = PolygonObstacle([(4.9, -1), (5.1, -1), (5.1, 7), (4.9, 7)])
    agent = robot(1, (1, 3, 0), (4, 3, 0), obstacles=[wall])
    for goal, error in (((5, 3, 0.0), GoalOccupied), ((9, 3, 0.0), NoPath)):
        with pytest.raises(error):
            agent.require_goal(goal)
