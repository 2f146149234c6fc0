"""Prediction: discs that give way to each other, the velocities they choose, and the way that comes of it."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from mobile_planning import Boundary, PolygonObstacle
from mobile_planning.fleet import prediction_kernels as kernels
from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.prediction import arcs, drive_on
from mobile_planning.fleet.search_lattice import SearchLattice
from mobile_planning.fleet.way_finder import WayFinder
from mobile_planning.world.environment import Environment

OPEN = Boundary((-10, 10), (-10, 10))
RADIUS, STEP = 0.2, 0.125


def predict(start, goal, others, *, velocity=(0.0, 0.0), environment=None, stalled=0.0):
    goal = np.asarray(goal, float)
    finder = WayFinder(SearchLattice(environment or Environment(OPEN), RADIUS), goal)
    return drive_on(finder, [start, goal], velocity, RADIUS, 1.0, others, 28 * STEP, stalled)


def coming(place, goal, velocity=(0.0, 0.0)):
    return Neighbour(place, place, goal, RADIUS, velocity=velocity)


def test_alone_it_drives_straight_to_the_goal_and_stays():
    track = predict((-1, 1), (1, 1), [], velocity=(1, 0))
    assert track[:, 1] == pytest.approx(1.0)
    assert track[:17, 0] == pytest.approx(-1 + STEP * np.arange(17))
    # It brakes as fast as anybody.
    assert track[17:] == pytest.approx(np.ones((len(track) - 17, 2)), abs=0.05)
    assert track[20:] == pytest.approx(np.ones((len(track) - 20, 2)))


@settings(max_examples=40, deadline=None)
@given(st.floats(0, 2 * np.pi), st.floats(-0.02, 0.02))
def test_two_that_meet_head_on_predict_each_other_and_pass_on_the_right(angle, aside):
    along, across = np.array(((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))))
    places, goals = (-1.5 * along, 1.5 * along + aside * across), (3 * along, -3 * along)
    own, theirs = (predict(places[i], goals[i], [coming(places[1 - i], goals[1 - i], velocity[::-1][i])],
                           velocity=velocity[i]) for velocity in [(along, -along)] for i in (0, 1))
    assert np.linalg.norm(own - theirs, axis=1).min() >= 2 * RADIUS - 1e-6
    nearest = np.linalg.norm(own - theirs, axis=1).argmin()
    assert (theirs - own)[nearest] @ across > 0


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 30))
def test_it_hangs_neither_on_the_order_of_the_others_nor_exceeds_the_limit_of_speed(seed, count):
    rng = np.random.default_rng(seed)
    others = [coming(place, goal) for place, goal in rng.uniform(-4, 4, (count, 2, 2))]
    track = predict((0, 0), (5, 1), others)
    assert np.array_equal(track, predict((0, 0), (5, 1), others[::-1]))
    assert (np.linalg.norm(np.diff(track, axis=0), axis=1) <= STEP * (1 + 1e-9)).all()


def test_it_goes_around_who_is_parked_and_keeps_off_walls():
    parked = Neighbour((0.0, 0.05), (0.0, 0.05), (0.0, 0.05), RADIUS, True)
    track = predict((-1.5, 0), (3, 0), [parked], velocity=(1, 0))
    assert np.linalg.norm(track - parked.position, axis=1).min() > 2 * RADIUS - 1e-6 and track[-1, 0] > 0.5
    wall = PolygonObstacle([(-5, 0.3), (5, 0.3), (5, 0.6), (-5, 0.6)])
    track = predict((-1.5, 0), (3, 0), [coming((1.5, 0), (-3, 0), (-1, 0))], velocity=(1, 0),
                    environment=Environment(OPEN, [wall]))
    assert track[:, 1].max() < 0.3 - 0.9 * RADIUS


def test_who_makes_no_progress_turns_to_the_right():
    head_on = [coming((1.0, 0), (-3, 0))]
    aside = [predict((0, 0), (3, 0), head_on, stalled=stalled)[2, 1] for stalled in (0.0, 1.7, 2.7)]
    assert aside[0] > aside[1] > aside[2]


def test_arcs_are_the_lengths_of_what_has_been_driven():
    track = np.array([(0, 0), (3, 4), (3, 4), (3, 5)], float)
    assert arcs(track, 3 * STEP, STEP * np.array([0, 0.5, 1, 2, 2.5, 3, 9])) == pytest.approx([0, 2.5, 5, 5, 5.5, 6, 6])


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 8))
def test_the_velocity_is_the_nearest_to_the_wish_that_keeps_to_all_lines(seed, count):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(0, 2 * np.pi, count)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    lines = np.column_stack([rng.uniform(-0.8, 0.8, (count, 2)), directions])
    wish, found = rng.uniform(-0.7, 0.7, 2), np.zeros(2)
    failed = kernels.best_velocity(lines, count, 1.0, *wish, False, found)
    left = np.column_stack([-directions[:, 1], directions[:, 0]])
    bounds = (left * lines[:, :2]).sum(axis=1)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 201)] * 2), axis=-1).reshape(-1, 2)
    free = grid[(np.linalg.norm(grid, axis=1) <= 1) & (grid @ left.T >= bounds).all(axis=1)]
    if failed < count:
        assert not len(free)
        bisectors = np.zeros((count + 1, 4))
        kernels.least_bad_velocity(lines, count, failed, 1.0, bisectors, found)
        # The least violation, by another program: within a polygon inside the disc, and around it.
        sides = np.linspace(0, 2 * np.pi, 65)[:-1]
        ball = np.column_stack([np.cos(sides), np.sin(sides), np.zeros(64)])
        rows = np.vstack([np.column_stack([-left, -np.ones(count)]), ball])
        least = [linprog((0, 0, 1), rows, np.append(-bounds, np.full(64, size)), bounds=(None, None)).fun
                 for size in (1.0 / np.cos(np.pi / 64), np.cos(np.pi / 64))]
        assert least[0] - 1e-6 <= (bounds - left @ found).max() <= least[1] + 1e-6
        return
    assert np.linalg.norm(found) <= 1 + 1e-9 and (left @ found >= bounds - 1e-9).all()
    if len(free):
        assert np.linalg.norm(found - wish) <= np.linalg.norm(free - wish, axis=1).min() + 1e-9
