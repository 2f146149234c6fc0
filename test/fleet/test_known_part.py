"""A mission of which the oldest plans were left out is judged from where all is known, and counts all arrivals."""
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.fleet.known_part import KnownPart
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.fleet.verification import verify
from mobile_planning.fleet.visits import visits
from mobile_planning.world.environment import Boundary

ROOM = Boundary((0, 6), (0, 6))
SCENE = Scene('rounds', (
    RobotSpec(1, (1, 1, 0), (1, 4, 1.57), 0.2, via=((3, 1, 0), (3, 4, 1.57))),
    RobotSpec(2, (5, 5, 3.14), (5, 3, -1.57), 0.2)), boundary=ROOM)
START = 100.0


@pytest.fixture(scope='module')
def driven():
    """Return the simulation of a mission in which one robot has three goals."""
    simulation = SCENE.world_sim()
    assert simulation.run(seed=1, start_time=START, errands=SCENE.errands()).valid
    return simulation


def without_oldest(simulation, eyed, count):
    """Return the solutions, one of them as a robot has it that keeps its newest plans alone."""
    solutions = dict(simulation.solutions)
    whole = solutions[eyed]
    count = min(count, len(whole.plans) - 1)
    begin = whole.plans[count].first_knot * whole.plans[count].step
    reached = sum(START + time <= begin for time in arrival_times(simulation, eyed))
    solutions[eyed] = replace(whole, plans=whole.plans[count:], commits=whole.commits[count:], reached_before=reached)
    return solutions, begin


def arrival_times(simulation, eyed):
    """Return when a robot had reached its goals [s], since the start."""
    from mobile_planning.fleet.track import Track
    body, solution = next(body for body in simulation.bodies if body.eyed == eyed), simulation.solutions[eyed]
    return visits(Track(body, list(solution.plans), solution.commits, START, solution.plans[0].step), 0.05, 0.05)


def test_a_mission_that_is_known_from_its_start_is_judged_as_ever(driven):
    known = KnownPart.of(driven.solutions, driven.bodies, START)
    report = known.report(driven.environment, START, 'rounds')
    assert report.judged_since == 0.0 and report.as_dict() == verify(
        driven.solutions, driven.bodies, driven.environment, START, 'rounds').as_dict()


@settings(max_examples=12)
@given(eyed=st.sampled_from([1, 2]), count=st.integers(8, 60))
def test_what_was_left_out_changes_neither_verdict_nor_arrivals(driven, eyed, count):
    solutions, begin = without_oldest(driven, eyed, count)
    whole = verify(driven.solutions, driven.bodies, driven.environment, START, 'rounds')
    report = KnownPart.of(solutions, driven.bodies, START).report(driven.environment, START, 'rounds')
    assert report.valid and not report.violations and report.judged_since == pytest.approx(begin - START)
    assert (report.arrived, report.arrivals, report.goals) == (whole.arrived, whole.arrivals, whole.goals) == (2, 4, 4)
    assert report.mission_time == pytest.approx(max(whole.mission_time, begin - START), abs=0.2)


def test_a_collision_in_the_known_part_is_found(driven):
    solutions, _ = without_oldest(driven, 1, 10)
    solutions[2] = replace(solutions[1], eyed=2)
    report = KnownPart.of(solutions, driven.bodies, START).report(driven.environment, START, 'rounds')
    assert not report.valid and any('closer than' in violation for violation in report.violations)
