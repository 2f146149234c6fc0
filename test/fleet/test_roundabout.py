"""Roundabouts: who is sent round, on which side, and that the circle stays where it is."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.roundabout import Roundabout, predict_crowd, updated

PLACES = st.tuples(st.floats(-8, 8), st.floats(-8, 8))
RADIUS = 0.2


def swap(count, size):
    """Return places on a circle and the goals opposite."""
    angle = 2 * np.pi * np.arange(count) / count
    places = size * np.column_stack([np.cos(angle), np.sin(angle)])
    return places, -places


def test_robots_that_swap_over_a_circle_crowd_in_its_middle():
    centre, size = predict_crowd(*swap(16, 4.0), RADIUS, 1.0)
    assert size == 16 and centre == pytest.approx((0, 0), abs=1e-9)


def test_three_are_no_crowd_nor_are_many_side_by_side():
    assert predict_crowd(*swap(3, 3.0), RADIUS, 1.0) is None
    row = np.column_stack([np.zeros(8), 0.9 * np.arange(8)])
    assert predict_crowd(row, row + (6, 0), RADIUS, 1.0) is None
    assert predict_crowd(row, row, RADIUS, 1.0) is None


@given(st.lists(st.tuples(PLACES, PLACES), min_size=4, max_size=20))
def test_a_crowd_is_the_largest_that_straight_drives_bring_together(robots):
    places, goals = np.array(robots).transpose(1, 0, 2)
    crowd = predict_crowd(places, goals, RADIUS, 1.0)
    lengths = np.linalg.norm(goals - places, axis=1)
    stride, most = 1.0 if len(places) > 16 else 0.5, 0
    for driven in np.arange(0.0, lengths.max(), max(stride, lengths.max() / 200)):
        going = lengths >= driven - stride / 2
        if going.sum() <= max(3, most):
            break
        at = (places + (goals - places) * np.minimum(1, driven / np.maximum(lengths, 1e-9))[:, None])[going]
        distances = np.sort(np.linalg.norm(at[:, None] - at, axis=2))
        most = max(most, *(n for row in distances for n, far in enumerate(row, 1) if far < 1.5 * RADIUS * n**0.5))
    assert (0 if crowd is None else crowd[1]) == (most if most >= 4 else 0)


@given(st.lists(st.tuples(PLACES, PLACES), min_size=4, max_size=12))
def test_the_prediction_is_that_of_any_order_in_size(robots):
    places, goals = np.array(robots).transpose(1, 0, 2)
    crowds = predict_crowd(places, goals, RADIUS, 1.0), predict_crowd(places[::-1], goals[::-1], RADIUS, 1.0)
    assert (crowds[0] is None) == (crowds[1] is None)
    if crowds[0] is not None:
        assert crowds[0][1] == crowds[1][1]


@settings(max_examples=200)
@given(PLACES, PLACES, PLACES, st.floats(0.4, 3.0))
def test_a_way_round_ends_at_the_goal_with_the_centre_on_the_left(place, goal, centre, radius):
    roundabout = Roundabout(np.array(centre), radius)
    way = roundabout.way(place, goal, legs=400)
    if way is None:
        return
    assert np.isfinite(way).all() and way[0] == pytest.approx(place) and way[-1] == pytest.approx(goal)
    kept = min(radius, 0.8 * np.hypot(*np.subtract(goal, centre)))
    steps, inward = np.diff(way, axis=0), np.array(centre) - way[:-1]
    cross = steps[:, 0] * inward[:, 1] - steps[:, 1] * inward[:, 0]
    assert (cross[:-1] >= -1e-9).all()
    # Once outside, a chord of the tangent is all that is cut off.
    outside = np.hypot(*(way - centre).T) >= kept
    first = np.argmax(outside)
    assert np.hypot(*(way[first:-1] - centre).T).min(initial=np.inf) >= kept - 0.05 if outside.any() else True


def test_where_the_straight_line_misses_the_circle_there_is_no_way_round():
    roundabout = Roundabout(np.zeros(2), 1.0)
    assert roundabout.way((-3, 1.1), (3, 1.1)) is None
    assert roundabout.way((-3, 0), (-5, 0)) is None
    assert roundabout.way((-3, 0.5), (3, 0.5)) is not None


def at(angle, distance):
    """Return the place so far from the middle of the circle, and the way of who drives round it there."""
    cos, sin = np.cos(angle), np.sin(angle)
    return distance * np.array((cos, sin)), np.array((-sin, cos))


def pace(angle, distance, ahead, away, circle=2.0, **other):
    """Return the pace on a circle of 2 m of one at ``angle`` behind another that is ``ahead`` [rad] of it."""
    place, heading = at(angle, distance)
    before, its_heading = at(angle + ahead, away)
    neighbour = Neighbour(before, before, (9, 0), **{'radius': RADIUS, 'velocity': its_heading, **other})
    return Roundabout(np.zeros(2), circle).pace(np.stack([place, place + 0.3 * heading]), (neighbour,), RADIUS)


@given(st.floats(-4, 4), st.floats(1.7, 2.3), st.floats(0.22, 0.4), st.floats(-0.1, 0.1))
def test_who_comes_close_to_one_before_it_on_the_circle_falls_back_the_more_the_closer(angle, distance, ahead, aside):
    paces = [pace(angle, distance, gap, distance + aside) for gap in (0.2, ahead, ahead + 0.02, 0.6)]
    assert paces == sorted(paces) and 0.0 < paces[0] < 0.8 and paces[-1] == 1.0
    assert pace(0.0, distance, ahead, distance + aside) == pytest.approx(paces[1], abs=1e-9)


@pytest.mark.parametrize('distance, ahead, away, other', [
    (2.0, -0.25, 2.0, {}), (2.0, 0.15, 1.5, {}), (1.5, 0.3, 1.35, {}), (2.5, 0.2, 2.65, {}), (2.65, 0.2, 2.5, {}),
    (1.35, 0.3, 1.5, {}), (2.0, 0.25, 2.0, {'is_parked': True}), (2.0, 0.25, 2.0, {'velocity': (0.5, -0.9)}),
    (1.6, 0.3, 1.6, {'circle': 1.6}), (2.0, 0.6, 2.0, {'radius': 0.6})])
def test_nobody_falls_back_behind_who_is_no_rival_nor_off_the_circle_nor_on_a_small_one(distance, ahead, away, other):
    assert pace(0.0, distance, ahead, away, **other) == 1.0
    assert pace(0.0, 2.0, 0.25, 2.0) < 0.8


def test_the_circle_stays_for_who_is_on_it_and_moves_a_little_for_who_is_far():
    before = updated(None, (np.zeros(2), 16), (9, 0), RADIUS)
    crowd = np.array((1.0, 0.0)), 14
    near, far = (updated(before, crowd, place, RADIUS) for place in ((2, 0), (9, 0)))
    assert near.centre == pytest.approx((0, 0)) and far.centre == pytest.approx((0.3, 0))
    assert before.radius > near.radius > far.radius


def test_the_circle_does_not_follow_what_is_left_of_a_crowd_that_has_begun_to_turn():
    before = updated(None, (np.zeros(2), 64), (16, 0), RADIUS)
    after = updated(before, (np.array((1.0, 0.9)), 21), (12, 0), RADIUS)
    assert after.centre == pytest.approx((0, 0)) and after.radius < before.radius


@given(st.permutations(range(16)), st.integers(1, 15))
def test_who_has_heard_few_at_first_goes_round_the_same_circle_as_the_others(heard, few):
    places, goals = swap(16, 4.0)
    everybody = predict_crowd(places, goals, RADIUS, 1.0)
    first = updated(None, predict_crowd(places[heard[:few]], goals[heard[:few]], RADIUS, 1.0), places[heard[0]], RADIUS)
    late, early = updated(first, everybody, places[heard[0]], RADIUS), updated(None, everybody, places[0], RADIUS)
    assert late.centre == pytest.approx(early.centre) and late.radius == early.radius


def test_the_circle_is_gone_some_time_after_the_crowd():
    roundabout, looks = updated(None, (np.zeros(2), 16), (3, 0), RADIUS), 0
    while roundabout is not None:
        roundabout, looks = updated(roundabout, None, (3, 0), RADIUS), looks + 1
    assert 3 <= looks <= 40
