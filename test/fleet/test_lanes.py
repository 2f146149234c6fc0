"""Lanes: who can meet whom there, told from afar."""
from itertools import permutations

import numpy as np
import pytest

from mobile_planning import Boundary, Environment, PolygonObstacle
from mobile_planning.fleet import lanes
from mobile_planning.fleet.lanes import LaneFinder
from mobile_planning.fleet.roadmap import Roadmap

RADIUS = 0.2


def wall(left, right, *doors, width=0.65):
    """Return the obstacles of a wall with doors at the given y, in a room 4 m wide."""
    ends = [0.0, *(y + side * width / 2 for y in doors for side in (-1, 1)), 4.0]
    return [PolygonObstacle([(left, low), (right, low), (right, high), (left, high)])
            for low, high in zip(ends[::2], ends[1::2])]


def test_whoever_is_left_out_from_afar_meets_nobody_in_a_lane():
    # Three rooms in a row, joined by a corridor and by a door.
    world = Environment(Boundary((0, 12), (0, 4)), [*wall(3.0, 5.0, 1.5), *wall(9.0, 9.2, 3.0)])
    finder, rng = LaneFinder(Roadmap(world, RADIUS)), np.random.default_rng(3)
    ends = rng.uniform((0.3, 0.3), (11.7, 3.7), (200, 2))
    ends = ends[world.clearance(ends) > RADIUS + 0.05][:120].reshape(-1, 2, 2)
    speeds = rng.choice((0.4, 1.0), len(ends))
    uses = [finder.uses(*pair, RADIUS, speed) for pair, speed in zip(ends, speeds)]
    met = left_out = 0
    for (own, _, _), (theirs, (place, _), speed) in permutations(zip(uses, ends, speeds), 2):
        for lane in own.keys() & theirs.keys():
            soonest = finder.soonest(lane, place, speed)
            assert soonest <= theirs[lane].since
            may, does = own[lane].may_meet(soonest), own[lane].meets(theirs[lane])
            assert may or not does
            met, left_out = met + does, left_out + (not may)
    assert met > 50 and left_out > 50


@pytest.mark.parametrize('others, rounds', [(1, 100), (60, 6), (400, 1)])
def test_the_field_of_a_goal_is_kept_as_long_as_it_is_asked_for(monkeypatch, others, rounds):
    world = Environment(Boundary((0, 12), (0, 4)), wall(5.0, 7.0, 1.5))
    finder, searched, search = LaneFinder(Roadmap(world, RADIUS)), [], lanes.dijkstra
    monkeypatch.setattr(lanes, 'dijkstra', lambda *args, **options: searched.append(0) or search(*args, **options))

    def used(*goal):
        return finder.uses((1.0, 2.0), goal, RADIUS, 1.0).keys()
    first, always = used(11.0, 2.0), used(9.0, 2.0)
    for y in list(np.linspace(1.0, 3.0, others)) * rounds:
        used(10.0, y)
        assert used(9.0, 2.0) == always != set()
    assert len(searched) == others + 2
    # Nobody has asked for the first one since.
    assert used(11.0, 2.0) == first and len(searched) == others + 3
