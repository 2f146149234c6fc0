"""WayFinder: what it says is in sight."""
from unittest import mock

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import Boundary, Environment, PolygonObstacle, RoundObstacle
from mobile_planning.fleet.search_lattice import SearchLattice
from mobile_planning.fleet.way_finder import WayFinder

RADIUS = 0.2
SHELF, PILLAR, EDGE = [(2, 1), (2.3, 1), (2.3, 3.4), (2, 3.4)], (4.5, 2.2), (0, 0, 6, 4)
WORLD = Environment(Boundary((0, 6), (0, 4)), [PolygonObstacle(SHELF), RoundObstacle(PILLAR, 0.5)])
FINDER = WayFinder(SearchLattice(WORLD, RADIUS), np.array((5.5, 3.5)))
PLACES = st.tuples(st.floats(-0.1, 6.1), st.floats(-0.1, 4.1))


def room_along(a, b):
    """Return how far the segment is from anything at its nearest; 0 outside the room."""
    way = shapely.LineString([a, b])
    if not shapely.box(*EDGE).covers(way):
        return 0.0
    return min(way.distance(shapely.Polygon(SHELF)), way.distance(shapely.Point(PILLAR)) - 0.5,
               way.distance(shapely.box(*EDGE).exterior))


@settings(max_examples=300, deadline=None)
@given(PLACES, PLACES)
def test_what_is_in_sight_has_room_and_what_has_room_to_spare_is_in_sight(a, b):
    least = room_along(a, b)
    if FINDER.is_open(a, b):
        # A start with less room than the body asks for no more than is seen that it has itself.
        asked = min(RADIUS**2, room_along(a, a)**2 - 0.5625 * FINDER.lattice.resolution**2)
        assert least > 0.0 and least**2 >= asked - 1e-6
    else:
        assert least < RADIUS + 0.02


@settings(max_examples=100, deadline=None)
@given(PLACES, PLACES, PLACES, st.floats(0.1, 1.0))
def test_no_line_of_sight_enters_a_disc_deeper_than_its_ends(a, b, disc, keep):
    way, middle = shapely.LineString([a, b]), shapely.Point(disc)
    if FINDER.is_open(a, b, np.array([[*disc, keep]])):
        assert way.distance(middle) >= min(keep, *(middle.distance(shapely.Point(end)) for end in (a, b))) - 1e-6


@settings(max_examples=40, deadline=None)
@given(st.lists(PLACES, min_size=2, max_size=4))
def test_a_way_around_discs_does_not_hang_on_what_was_asked_before(places):
    """Neither on how much of the field was computed for another place."""
    across = np.array([(2.15, 3.7, 0.5), (3.3, 2.0, 0.4), (5.2, 2.2, 0.3)])
    asked = WayFinder(FINDER.lattice, FINDER.goal)
    # No search from the start: all by the field.
    with mock.patch('mobile_planning.fleet.way_finder._LIMIT', 0):
        for place in places:
            way = asked.way(place, across)
            assert np.array_equal(way, WayFinder(FINDER.lattice, FINDER.goal).way(place, across))
