"""Guidance: free paths near the optimum, references in sight, the right-hand rule, the nearer side of the parked."""
from functools import lru_cache

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from mobile_planning import Boundary, Environment, InvalidInput, NoPath, OccupancyGrid, PolygonObstacle, RoundObstacle
from mobile_planning.fleet.guidance import Guidance, Neighbour
from mobile_planning.fleet.roundabout import Roundabout
from mobile_planning.fleet.search_lattice import SearchLattice

ROOM = Boundary((0, 10), (0, 6))
PLACES = st.tuples(st.floats(0.4, 9.6), st.floats(0.4, 5.6))
RADIUS, STEP, SPANS = 0.2, 0.25, 12
#: What the guidance's picture of the room may lack [m] with cells of a quarter of the radius.
LOSS = 0.005


def guide(environment, goal, radius=RADIUS, v_max=1.0, **options):
    return Guidance(SearchLattice(environment, radius, **options), goal, v_max)


#: Asked again and again: no answer may depend on the one before.
guide_again = lru_cache(guide)


def wall(low, high):
    return PolygonObstacle([low, (high[0], low[1]), high, (low[0], high[1])])


def door(gap, x=5.0, y=3.0, thickness=0.2):
    """Return the two walls beside a door in the middle of ROOM."""
    left, right = x - thickness / 2, x + thickness / 2
    return [wall((left, -1), (right, y - gap / 2)), wall((left, y + gap / 2), (right, 7))]


PILLARS = Environment(ROOM, [RoundObstacle((5, 3), 1.0), wall((2, 1), (3, 4)), RoundObstacle((7.5, 4.3), 0.5)])
DOOR = Environment(ROOM, door(0.6))
CORNER = Environment(ROOM, [wall((4, 0), (6, 4))])


def length(path):
    return np.linalg.norm(np.diff(path, axis=0), axis=1).sum()


def along(path, step=0.02):
    """Return points every ``step`` of a path."""
    return np.concatenate([a + np.linspace(0, 1, max(2, int(np.linalg.norm(b - a) / step)))[:, None] * (b - a)
                           for a, b in zip(path, path[1:])])


def drive(start, speed, heading=0.0):
    """Return where a robot is at the next knots that drives straight on."""
    ahead = np.arange(1, SPANS + 1)[:, None] * STEP * speed
    return np.asarray(start, float) + ahead * (np.cos(heading), np.sin(heading))


def rest(place):
    return np.tile(np.asarray(place, float), (SPANS, 1))


def standing_robot(place, radius=RADIUS):
    return Neighbour(place, place, place, radius, True)


def coming(place, end, goal, radius=RADIUS):
    return Neighbour(place, end, goal, radius, False)


def angle(guidance, standing, neighbours=(), stalled=0.0):
    """Return the direction [rad] from the robot to the last row of its reference, positive to the left of +x."""
    reference = guidance.reference(standing, neighbours, STEP, stalled)
    offset = reference[-1] - standing[0]
    return np.arctan2(offset[1], offset[0])


# The path


@settings(max_examples=30, deadline=None)
@given(PLACES, PLACES)
def test_in_an_empty_room_the_path_is_nearly_the_straight_line(start, goal):
    path = guide(Environment(ROOM), goal).path(start)
    assert path[0] == pytest.approx(start) and path[-1] == pytest.approx(goal)
    assert length(path) <= np.linalg.norm(np.subtract(goal, start)) + 0.1


@settings(max_examples=30, deadline=None)
@given(PLACES, PLACES, st.sampled_from([PILLARS, DOOR, CORNER]))
def test_the_path_keeps_the_body_off_what_stands_in_the_way(start, goal, world):
    assume(world.clearance([start, goal]).min() >= RADIUS + LOSS)
    path = guide(world, goal).path(start)
    assert world.clearance(along(path)).min() >= RADIUS - 1e-6


@settings(max_examples=30, deadline=None)
@given(PLACES, PLACES, st.floats(0.5, 3.5), st.floats(0.6, 2.0))
def test_the_path_is_nearly_as_short_as_round_a_disc(start, goal, y, size):
    """Independent oracle: tangents and an arc around the disc grown by body and comfort."""
    world = Environment(Boundary((0, 10), (-6, 12)), [RoundObstacle((5, y), size)])
    grown = size + 1.5 * RADIUS + 0.1
    a, b = np.subtract(start, (5, y)), np.subtract(goal, (5, y))
    assume(min(np.hypot(*a), np.hypot(*b)) >= grown)
    if shapely.LineString([a, b]).distance(shapely.Point(0, 0)) >= grown:
        least = np.hypot(*(a - b))
    else:
        between = abs((np.arctan2(a[1], a[0]) - np.arctan2(b[1], b[0]) + np.pi) % (2 * np.pi) - np.pi)
        arc = between - np.arccos(grown / np.hypot(*a)) - np.arccos(grown / np.hypot(*b))
        least = grown * max(arc, 0) + np.sqrt(a @ a - grown**2) + np.sqrt(b @ b - grown**2)
    assert length(guide(world, goal).path(start)) <= 1.01 * least + 0.1


@settings(max_examples=25, deadline=None)
@given(st.floats(0, np.pi), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_a_door_of_three_radii_is_found_wherever_it_lies(turn, dx, dy):
    cos, sin = np.cos(turn), np.sin(turn)
    walls = [np.array(part.vertices) - (5, 3) for part in door(3 * RADIUS)]
    world = Environment(ROOM, [PolygonObstacle(part @ np.array([[cos, sin], [-sin, cos]]) + (5 + dx, 3 + dy))
                               for part in walls])
    start, goal = np.array((5, 3)) - (1.5 * cos, 1.5 * sin), np.array((5, 3)) + (1.5 * cos, 1.5 * sin)
    for resolution in (None, RADIUS / 2):
        assert length(guide(world, goal, resolution=resolution).path(start)) <= 3.3


def test_the_narrow_door_is_taken_where_the_way_round_is_long_and_left_where_it_is_not():
    walls = [wall((4.9, -1), (5.1, 1.0)), wall((4.9, 1.6), (5.1, 5.0))]
    path = guide(Environment(ROOM, walls), (9, 1.3)).path((1, 1.3))
    assert length(path) <= 8.1
    path = guide(Environment(ROOM, walls), (9, 5.3)).path((1, 5.3))
    assert length(path) <= 8.1


def test_no_path_is_an_error_of_its_own():
    guidance = guide(Environment(ROOM, [wall((4.9, -1), (5.1, 7))]), (9, 3))
    with pytest.raises(NoPath, match='0.2 m'):
        guidance.path((1, 3))
    assert guidance.length((1, 3)) == np.inf


def test_a_gap_narrower_than_the_body_is_no_path():
    with pytest.raises(NoPath):
        guide(Environment(ROOM, door(0.39)), (9, 3)).path((1, 3))
    assert len(guide(Environment(ROOM, door(0.39)), (9, 3), radius=0.1).path((1, 3))) >= 2


@pytest.mark.parametrize('goal', [(0.201, 3), (9.799, 5.799), (0.201, 0.201), (5, 5.799)])
def test_a_goal_with_hardly_more_room_than_the_body_is_reached(goal):
    path = guide(Environment(ROOM), goal).path((5, 3))
    assert path[-1] == pytest.approx(goal)
    assert length(path) <= 1.05 * np.linalg.norm(np.subtract(goal, (5, 3)))


@pytest.mark.parametrize('start', [(0.2, 0.2), (0.12, 3.0), (9.9, 5.9)])
def test_a_start_inside_the_margin_is_left(start):
    guidance = guide(Environment(ROOM), (6, 2))
    assert len(guidance.path(start)) >= 2
    reference = guidance.reference(rest(start), (), STEP, 0.0)
    assert np.linalg.norm(reference[-1] - start) > 1.0


def test_a_turned_map_is_walked_in_the_frame_of_the_world():
    data = np.zeros((60, 100), int)
    data[:40, 50] = 100
    grid = OccupancyGrid(data, 0.1, (3.0, -2.0, 0.6))
    world = Environment(grid=grid)
    start, goal = grid.cell_to_world([(10, 10), (90, 10)])
    path = guide(world, goal).path(start)
    cells = grid.cell_to_world(np.argwhere(data)[:, ::-1])
    assert np.linalg.norm(along(path)[:, None] - cells, axis=-1).min() >= RADIUS + 0.05
    assert 9.5 < length(path) < 11.5


def test_at_the_goal_the_path_and_the_reference_are_a_point():
    guidance = guide(Environment(ROOM), (5, 3))
    assert length(guidance.path((5, 3))) == guidance.length((5, 3)) == 0
    assert guidance.reference(rest((5, 3)), (), STEP, 0.0) == pytest.approx(rest((5, 3)))


@settings(max_examples=30, deadline=None)
@given(PLACES, st.sampled_from([PILLARS, DOOR, CORNER]))
def test_the_length_falls_as_fast_as_the_robot_drives(start, world):
    assume(world.clearance(start) >= RADIUS + LOSS)
    guidance = guide(world, (9, 1))
    path = guidance.path(start)
    assert guidance.length(start) == pytest.approx(length(path))
    points = along(path, 0.25)
    left = np.array([guidance.length(point) for point in points])
    driven = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    assert np.abs(left + driven - left[0]).max() <= 0.02 * left[0] + 0.15


# The reference


def test_the_reference_runs_ahead_of_the_fastest_drive():
    reference = guide(Environment(ROOM), (9, 3), v_max=0.8).reference(rest((1, 3)), (), STEP, 0.0)
    assert reference[:, 0] == pytest.approx(1 + 0.15 + 1.05 * 0.8 * STEP * np.arange(1, SPANS + 1), abs=1e-6)
    assert reference[:, 1] == pytest.approx(np.full(SPANS, 3.0))


def test_the_reference_ends_at_the_goal_when_that_is_near():
    for goal in ((3, 3), (0.201, 2.5)):
        reference = guide(Environment(ROOM), goal).reference(rest((1.5, 3)), (), STEP, 0.0)
        assert reference[-1] == pytest.approx(goal)


WALKS = npst.arrays(float, (SPANS, 2), elements=st.floats(-0.25, 0.25, width=32))


@settings(max_examples=150, deadline=None)
@given(PLACES, st.sampled_from([(9, 1), (1, 5), (7, 3.4), (9.79, 5.79)]), WALKS,
       st.sampled_from([PILLARS, DOOR, CORNER]), st.floats(0, 5),
       st.lists(st.tuples(PLACES, PLACES, st.booleans(), st.floats(0.1, 0.5)), max_size=4))
def test_every_point_drawn_to_is_in_sight_of_the_plan_at_that_knot(start, goal, walk, world, stalled, others):
    standing = np.clip(np.cumsum(np.vstack([start, walk[1:]]), axis=0), 0.01, 9.99)
    neighbours = [Neighbour(place, place if is_parked else end, place if is_parked else end, radius, is_parked)
                  for place, end, is_parked, radius in others]
    reference = guide_again(world, goal).reference(standing, neighbours, STEP, stalled)
    assert reference.shape == standing.shape
    for place, drawn in zip(standing, reference):
        if world.clearance(place) >= RADIUS + LOSS:
            assert world.clearance(along(np.stack([place, drawn]), 0.005)).min() >= RADIUS - 1e-6


def test_around_a_corner_the_plan_is_drawn_to_the_corner_first():
    guidance = guide(CORNER, (8, 1))
    reference = guidance.reference(rest((3, 3.0)), (), STEP, 0.0)
    # Sight ends at the corner (4, 4), while the path goes on.
    assert reference[-1, 1] > 4.0 and reference[-1, 0] < 5.0
    assert (np.diff(np.linalg.norm(reference - (3, 3), axis=1)) >= -1e-9).all()


def test_a_plan_that_is_round_the_corner_is_drawn_further():
    guidance = guide(CORNER, (8, 1))
    standing = np.vstack([np.linspace((3.5, 3.8), (3.8, 4.3), 6), np.linspace((3.9, 4.4), (6.2, 4.4), 6)])
    reference = guidance.reference(standing, (), STEP, 0.0)
    assert reference[-1, 0] > 6.2 and reference[-1, 1] < 4.4


def test_without_a_path_the_plan_stays_as_it_is():
    guidance = guide(Environment(ROOM, [wall((4.9, -1), (5.1, 7))]), (9, 3))
    standing = drive((1, 3), 0.3)
    assert (guidance.reference(standing, [coming((2, 3), (2, 3), (0, 3))], STEP, 3.0) == standing).all()


ANYWHERE = st.floats(-10, 20) | st.floats(allow_nan=False, allow_infinity=False)
ANY_PLACE = st.tuples(ANYWHERE, ANYWHERE)


@settings(max_examples=200, deadline=None)
@given(npst.arrays(float, st.tuples(st.integers(1, 6), st.just(2)), elements=ANYWHERE),
       st.sampled_from([(9.0, 1.0), (5.0, 3.0), (-3.0, 30.0), (1e308, -1e308)]),
       st.lists(st.tuples(ANY_PLACE, ANY_PLACE, ANY_PLACE, st.floats(0.01, 1e3), st.booleans()), max_size=4),
       st.floats(0.01, 10), st.floats(0, 1e9))
@example(np.zeros((2, 2)), (5.0, 3.0), [((1e308, -1e308),) * 3 + (1.0, False)], 0.25, 0.0)
@example(np.full((2, 2), 3.0), (3.0, 3.0), [((3.0, 3.0),) * 3 + (1.0, True)], 0.25, 0.0)
def test_whatever_is_finite_gives_a_finite_reference(standing, goal, others, step, stalled):
    reference = guide_again(PILLARS, goal).reference(standing, [Neighbour(*other) for other in others], step, stalled)
    assert np.isfinite(reference).all() and reference.shape == standing.shape


def test_what_is_not_finite_or_not_positive_is_refused():
    for goal, radius, v_max in (((np.nan, 3), 0.2, 1), ((1, 3), 0, 1), ((1, 3), 0.2, np.inf), ((1, 3), 0.2, -1)):
        with pytest.raises(InvalidInput):
            guide(Environment(ROOM), goal, radius, v_max)
    with pytest.raises(InvalidInput):
        guide(Environment(ROOM), (5, 3)).reference([(np.inf, 1)], (), STEP, 0.0)


# Moving robots: the right-hand rule


@settings(max_examples=50, deadline=None)
@given(st.floats(0.5, 1.0), st.floats(-0.2, 0.2), st.floats(0, 4))
def test_two_that_meet_both_turn_right(gap, aside, stalled):
    left, right = np.array((5 - gap / 2, 3)), np.array((5 + gap / 2, 3 + aside))
    goals = (9, 3), (1, 3)
    turn = angle(guide(Environment(ROOM), goals[0]), rest(left), [coming(right, right, goals[1])], stalled)
    assert -np.deg2rad(121) <= turn < -0.02
    # The same, seen by the other: turned by half a turn.
    seen = angle(guide(Environment(ROOM), goals[1]), rest(right), [coming(left, left, goals[0])], stalled)
    direction = np.arctan2(*(np.subtract(goals[1], right)[::-1]))
    assert (seen - direction + np.pi) % (2 * np.pi) - np.pi < -0.02


def test_the_turn_grows_while_there_is_no_progress():
    guidance, other = guide(Environment(ROOM), (9, 3)), [coming((4.42, 3), (4.42, 3), (1, 3))]
    turns = [-angle(guidance, rest((4, 3)), other, stalled) for stalled in (0, 1, 2, 3, 4, 20)]
    assert np.rad2deg(turns) == pytest.approx(np.array([60, 60, 80, 100, 120, 120]) * (1 - 0.02 / 0.7), abs=0.5)


def test_nobody_turns_for_what_is_behind_far_or_going_the_same_way():
    guidance = guide(Environment(ROOM), (9, 3))
    for other in (coming((3, 3), (3, 3), (8, 3)), coming((5.3, 3), (5.3, 3), (1, 3)),
                  coming((4.8, 3), (5.5, 3), (9, 3.5))):
        assert angle(guidance, rest((4, 3)), [other]) == pytest.approx(0)


def test_large_robots_turn_from_further_away():
    for radius, turns in ((0.2, False), (0.5, True)):
        other = coming((5.3, 3), (5.3, 3), (1, 3), radius)
        assert (angle(guide(Environment(ROOM), (9, 3), radius=radius), rest((4, 3)), [other]) < -0.02) == turns


def test_the_turn_stops_at_a_wall():
    # A corridor wide enough for half a turn, then one for none.
    free = Environment(Boundary((0, 10), (2.0, 6.0)))
    tight = Environment(Boundary((0, 10), (2.7, 6.0)))
    other = [coming((4.42, 3), (4.42, 3), (1, 3))]
    full, half, none = (angle(guide(world, (9, 3)), rest((4, 3)), other) for world in (Environment(ROOM), free, tight))
    assert none == pytest.approx(0) and half == pytest.approx(full / 2, abs=0.02)


# Parked robots


@settings(max_examples=30, deadline=None)
@given(st.floats(-0.45, 0.45), st.floats(0.7, 2.5), st.floats(-np.pi, np.pi), st.floats(0.1, 0.4))
def test_a_parked_robot_is_passed_on_the_nearer_side(aside, distance, heading, radius):
    assume(abs(aside) > 0.03)
    width = RADIUS + radius + 0.1
    # Beyond this angle it is passed without a turn.
    assume(abs(aside) < width - 0.05 and np.hypot(aside, distance) > width + 0.02)
    world = Environment(Boundary((-7, 7), (-7, 7)))
    ahead = np.array((np.cos(heading), np.sin(heading)))
    parked = distance * ahead + aside * np.array((-ahead[1], ahead[0]))
    guidance = guide(world, 6 * ahead)
    turn = angle(guidance, rest((0, 0)), [standing_robot(parked, radius)]) - heading
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    away = np.hypot(aside, distance)
    expected = np.arcsin(width / away) - np.arcsin(abs(aside) / away)
    # The tangent to the circle that is kept, to the precision of a cell at that distance.
    assert -np.sign(aside) * turn == pytest.approx(expected, abs=0.06 / np.sqrt(away**2 - width**2) + 0.03)


def test_a_parked_robot_beside_or_beyond_the_way_changes_nothing():
    guidance = guide(Environment(ROOM), (7, 3))
    for place in ((5, 3.6), (7.6, 3), (1, 3)):
        assert angle(guidance, rest((2, 3)), [standing_robot(place)]) == pytest.approx(0)


def test_where_the_nearer_side_is_walled_the_other_is_taken():
    # The robot stands 0.25 m below the way, with 0.5 m between it and the wall: too little to pass.
    world = Environment(ROOM, [wall((3, 0), (7, 2.05))])
    parked = standing_robot((5, 2.75))
    guidance = guide(world, (9, 2.7))
    path = guidance.path((1, 2.7), [parked])
    assert world.clearance(along(path)).min() >= RADIUS
    assert np.linalg.norm(along(path) - (5, 2.75), axis=1).min() >= 2 * RADIUS
    assert path[:, 1].max() > 3.1


def test_a_parked_robot_in_a_door_is_avoided_by_way_of_the_other_door():
    walls = [wall((4.9, 0.7), (5.1, 2.7)), wall((4.9, 3.3), (5.1, 6))]
    guidance, parked = guide(Environment(ROOM, walls), (8, 5)), [standing_robot((5, 3))]
    start, left = np.array((2.0, 5.0)), []
    assert guidance.path(start)[:, 1].min() > 2.8
    for _ in range(120):
        path = guidance.path(start, parked)
        left.append(length(path))
        if left[-1] < 0.1:
            break
        start = along(path, 0.1)[1]
    assert 11 < left[0] < 12 and left[-1] < 0.1 and np.diff(left).max() < 0.02


def test_parked_robots_that_close_every_way_are_left_out():
    guidance = guide(Environment(Boundary((0, 10), (0, 1))), (9, 0.5))
    assert length(guidance.path((1, 0.5), [standing_robot((5, 0.5))])) == pytest.approx(8.0, abs=0.1)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(2.5, 7.5), st.floats(1, 5)), min_size=1, max_size=6), st.floats(1, 5),
       st.floats(1, 5))
def test_who_follows_the_path_arrives_and_never_turns_back(places, start_y, goal_y):
    """Drive along the path, asked for anew every 0.1 m: the way that is left only shrinks."""
    assume(all(np.hypot(*np.subtract(a, b)) > 0.45 for i, a in enumerate(places) for b in places[:i]))
    guidance = guide(Environment(ROOM, [wall((4.5, 0), (5.0, 2))]), (9, goal_y))
    parked, place, before = [standing_robot(other) for other in places], np.array((1, start_y)), np.inf
    for _ in range(200):
        path = guidance.path(place, parked)
        if length(path) <= 0.1:
            return
        assert length(path) <= before + 0.02
        before, place = length(path), along(path, 0.1)[1] if len(path) > 1 else path[0]
    pytest.fail(f'never arrived: {place}')


@settings(max_examples=30, deadline=None)
@given(PLACES, st.lists(PLACES, max_size=3), st.floats(0, 3))
def test_the_same_question_has_the_same_answer(start, places, stalled):
    others = [standing_robot(place) for place in places] + [coming((3, 3), (4, 3), (1, 1))]
    asked = [guidance.reference(rest(start), others, STEP, stalled)
             for guidance in (guide(PILLARS, (9, 1)), guide_again(PILLARS, (9, 1)), guide_again(PILLARS, (9, 1)))]
    assert (asked[0] == asked[1]).all() and (asked[1] == asked[2]).all()


# Roundabouts


def test_on_a_roundabout_a_robot_falls_back_from_one_close_before_it():
    guidance, roundabout = guide(Environment(ROOM), (9, 3)), Roundabout(np.array((5.0, 3.0)), 2.0)
    here, ahead = (3.0, 3.0), (5 - 2 * np.cos(0.25), 3 - 2 * np.sin(0.25))
    other = Neighbour(ahead, ahead, (9, 3), RADIUS, velocity=(0.4, -0.9))
    alone, among = (guidance.reference(rest(here), others, STEP, 0.0, roundabout=roundabout)
                    for others in ((), (other,)))
    gone = np.linalg.norm(np.stack([alone, among])[:, -1] - here, axis=1)
    assert 0 < gone[1] < 0.8 * gone[0]


def test_a_roundabout_is_taken_with_the_centre_on_the_left_hand_where_nothing_stands_in_it():
    roundabout = Roundabout(np.array((5.0, 3.0)), 1.0)
    for world, taken in ((Environment(ROOM), True), (PILLARS, False)):
        reference = guide(world, (9, 3)).reference(rest((2, 3.05)), (), STEP, 0.0, roundabout=roundabout)
        assert (reference[-1, 1] < 2.7) == taken
