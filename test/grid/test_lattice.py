"""The lattice planner against its document and a Dijkstra search on an explicit graph."""
import doctest
import heapq

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.errors import (
    Cancelled, GoalOccupied, GoalOutside, InvalidInput, LimitExceeded, NoPath, StartOccupied, StartOutside)
from mobile_planning.grid.lattice import LatticePlanner
from mobile_planning.grid.motion_primitives import motion_primitives
from mobile_planning.world.occupancy_grid import OccupancyGrid

DOCUMENT = '''
>>> from mobile_planning import LatticePlanner
>>> import numpy as np
>>> lattice = LatticePlanner();
>>> lattice.plan(iterations=6)
>>> path, status = lattice.query(start=(0, 0, 0), goal=(1, 2, np.pi/2))
>>> print(path.T)
[[0.     1.     1.    ]
 [0.     1.     2.    ]
 [0.     1.5708 1.5708]]
>>> print(status)
LatticeStatus(cost=2.5707963267948966, segments=['L', 'S'], edges=[Edge{[0] -- [0L], cost=1.571}, Edge{[0L] -- [0LS], \
cost=1}])
'''
# One quarter turn from each of four headings, by hand: what the robot's centre crosses.
FOUR = [
    (move, (dx, dy), turn, crossed)
    for move, (dx, dy), turn, crossed in (
        ('S', (1, 0), 0, [(1, 0)]), ('L', (1, 1), 1, [(1, 0), (1, 1)]), ('R', (1, -1), 3, [(1, 0), (1, -1)]))]


def turned(cell, quarters):
    x, y = cell
    for _ in range(quarters):
        x, y = -y, x
    return x, y


def brute_force(occupied, start, costs=(1, np.pi / 2, np.pi / 2)):
    """Return the least cost of each state (x, y, quarter) by Dijkstra, with motions written down by hand."""
    height, width = occupied.shape
    best, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        cost, (x, y, quarter) = heapq.heappop(queue)
        if cost > best[x, y, quarter]:
            continue
        for (_, move, turn, crossed), more in zip(FOUR, costs):
            cells = [np.add((x, y), turned(cell, quarter)) for cell in crossed]
            if any(not (0 <= a < width and 0 <= b < height) or occupied[b, a] for a, b in cells):
                continue
            dx, dy = turned(move, quarter)
            state = (x + dx, y + dy, (quarter + turn) % 4)
            if cost + more < best.get(state, np.inf) - 1e-12:
                best[state] = cost + more
                heapq.heappush(queue, (cost + more, state))
    return best


def any_graph(occupied, start, motions, costs, corner_cutting):
    """Return the least cost of each state (x, y, heading) by Dijkstra over the given motions."""
    height, width = occupied.shape
    best, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        cost, (x, y, heading) = heapq.heappop(queue)
        if cost > best[x, y, heading]:
            continue
        for motion, more in zip(motions, costs):
            if motion.heading != heading:
                continue
            cells = motion.swept_cells(corner_cutting) + (x, y)
            if (cells < 0).any() or (cells >= (width, height)).any() or occupied[cells[:, 1], cells[:, 0]].any():
                continue
            state = (x + motion.end[0], y + motion.end[1], motion.end_heading)
            if cost + more < best.get(state, np.inf) - 1e-12:
                best[state] = cost + more
                heapq.heappush(queue, (cost + more, state))
    return best


def random_grid(seed, crowd=0.2):
    """Return the occupied cells and a free one."""
    random = np.random.default_rng(seed)
    occupied = random.random(random.integers(1, 11, 2)) < crowd
    occupied.flat[random.integers(occupied.size)] = False
    free = np.argwhere(~occupied)[:, ::-1]
    return occupied, tuple(free[random.integers(len(free))].tolist())


def states(planner, configurations):
    off = np.abs(np.angle(np.exp(1j * (configurations[:, 2, None] - planner.angles))))
    return {(int(x), int(y), int(h)) for (x, y, _), h in zip(configurations, off.argmin(axis=1))}


def test_the_documents_example_runs_word_for_word():
    with np.printoptions(precision=4):
        example = doctest.DocTestParser().get_doctest(DOCUMENT, {}, 'document', None, 0)
        assert doctest.DocTestRunner(verbose=False).run(example).failed == 0


def test_six_iterations_make_the_graph_that_the_reference_counted():
    lattice = LatticePlanner()
    lattice.plan(6)
    assert len(lattice.vertices) == 372 and lattice.nedges == 627
    assert len(np.unique(lattice.vertices.round(6), axis=0)) == 372


@given(st.integers(0, 2 ** 30))
def test_the_graph_is_what_the_root_reaches(seed):
    occupied, cell = random_grid(seed)
    lattice = LatticePlanner(root=(*cell, np.pi / 2), occgrid=occupied)
    lattice.plan()
    assert states(lattice, lattice.vertices) == set(brute_force(occupied, (*cell, 1)))


@settings(max_examples=30)
@given(st.integers(0, 2 ** 30), st.booleans(), st.sampled_from([None, (1, 3, 1), (5, 1, 2)]))
def test_every_query_costs_what_brute_force_finds(seed, planned, costs):
    occupied, cell = random_grid(seed)
    best = brute_force(occupied, (*cell, 0), costs or (1, np.pi / 2, np.pi / 2))
    lattice = LatticePlanner(costs, (*cell, 0), occgrid=occupied)
    if planned:
        lattice.plan()
    for y, x in np.argwhere(~occupied):
        for quarter in range(4):
            goal = (x, y, quarter * np.pi / 2)
            if (x, y, quarter) not in best:
                with pytest.raises(NoPath):
                    lattice.query((*cell, 0), goal)
                continue
            path, status = lattice.query((*cell, 0), goal)
            assert status.cost == pytest.approx(best[x, y, quarter], abs=1e-9)
            assert sum(edge.cost for edge in status.edges) == pytest.approx(status.cost)
            assert np.array_equal(path[0, :2], cell) and np.array_equal(path[-1, :2], (x, y))
            assert [edge.move for edge in status.edges] == status.segments and len(path) == len(status.edges) + 1


@settings(max_examples=15)
@given(st.integers(0, 2 ** 30), st.sampled_from([8, 16]), st.floats(0.5, 3.0), st.booleans(), st.booleans(),
       st.floats(0.0, 2.0))
def test_lattices_with_more_headings_are_optimal_too(seed, headings, radius, reverse, corner_cutting, turn_cost):
    occupied, cell = random_grid(seed, 0.1)
    lattice = LatticePlanner(occgrid=occupied, headings=headings, radius=radius, turn_cost=turn_cost,
                             reverse_cost=2.0 if reverse else None, corner_cutting=corner_cutting, root=(*cell, 0))
    motions = motion_primitives(headings, radius, reverse)
    costs = [(m.length + turn_cost * abs(m.turn)) * (2.0 if m.is_reverse else 1.0) for m in motions]
    best = any_graph(occupied, (*cell, 0), motions, costs, corner_cutting)
    lattice.plan()
    assert states(lattice, lattice.vertices) == set(best)
    random = np.random.default_rng(seed)
    reached = list(best)
    for i in random.integers(len(reached), size=10):
        x, y, heading = reached[i]
        _, status = lattice.query((*cell, 0), (x, y, lattice.angles[heading]))
        assert status.cost == pytest.approx(best[reached[i]], abs=1e-9)
        _, status = lattice.query((*cell, 0), (x, y))
        assert status.cost == pytest.approx(min(best.get((x, y, h), np.inf) for h in range(headings)), abs=1e-9)


@settings(max_examples=20)
@given(st.integers(0, 2 ** 30), st.sampled_from([4, 16]))
def test_the_curve_of_a_path_stays_in_free_cells_and_turns_no_tighter_than_the_radius(seed, headings):
    occupied, cell = random_grid(seed, 0.08)
    lattice = LatticePlanner(occgrid=occupied, headings=headings, radius=1.5, reverse_cost=1.5)
    free = np.argwhere(~occupied)[:, ::-1]
    try:
        path, _ = lattice.query((*cell, 0), free[seed % len(free)])
    except NoPath:
        return
    curve, directions = lattice.curve(path)
    inside = (np.abs(curve[:, :2] - np.rint(curve[:, :2])) < 0.499).all(axis=1)
    x, y = np.rint(curve[inside, :2]).astype(int).T
    assert not occupied[y, x].any() and len(directions) == len(curve)
    steps = np.diff(curve, axis=0)
    bend = np.abs(np.angle(np.exp(1j * steps[:, 2])))
    assert (bend <= np.hypot(*steps[:, :2].T) / 1.5 * 1.01 + 1e-9).all()


def test_backwards_the_body_keeps_its_heading_along_the_curve():
    lattice = LatticePlanner(occgrid=np.zeros((1, 20)), headings=16, reverse_cost=1.0)
    path, status = lattice.query((15, 0, 0), (4, 0, 0))
    curve, directions = lattice.curve(path)
    assert set(status.segments) == {'s'} and (np.diff(curve[:, 0]) < 0).all() and (curve[:, 2] == 0).all()
    assert (directions[1:] == -1).all()


def test_the_lengths_of_the_edges_are_those_of_their_curves():
    lattice = LatticePlanner((1, 7, 3), occgrid=np.zeros((30, 40)), headings=16, radius=3, turn_cost=2)
    path, status = lattice.query((2, 2, 0), (30, 21, np.pi))
    curve, _ = lattice.curve(path)
    assert sum(edge.length for edge in status.edges) == pytest.approx(
        np.hypot(*np.diff(curve, axis=0).T[:2]).sum(), rel=1e-4)


def test_a_curve_is_one_of_configurations_and_straight_where_no_motion_is_known():
    lattice = LatticePlanner()
    curve, directions = lattice.curve([(0, 0, 0), (5, 3, 0)])
    assert curve.tolist() == [[0, 0, 0], [5, 3, 0]] and directions.tolist() == [1, 1]
    for wrong in ([(0, 0), (1, 0)], [], 'path'):
        with pytest.raises(InvalidInput, match='path'):
            lattice.curve(wrong)


def test_an_arc_needs_the_cell_that_it_crosses():
    lattice = LatticePlanner(occgrid=[[0, 1], [0, 0]])
    lattice.plan()
    assert len(lattice.vertices) == 1
    with pytest.raises(NoPath):
        lattice.query((0, 0, 0), (1, 1, np.pi / 2))


def test_a_longer_search_than_the_graph_finds_nothing_more():
    lattice = LatticePlanner()
    lattice.plan(iterations=1)
    assert len(lattice.vertices) == 4 and lattice.nedges == 3
    assert lattice.query((0, 0, 0), (1, 0, 0))[1].segments == ['S']
    with pytest.raises(NoPath):  # both are vertices, but no edge leaves the last ones found
        lattice.query((1, 0, 0), (1, 1, np.pi / 2))
    with pytest.raises(InvalidInput, match='not in the lattice'):
        lattice.query((0, 0, 0), (2, 0, 0))


def test_no_iteration_is_the_root_alone():
    lattice = LatticePlanner(root=(3, -4, np.pi))
    lattice.plan(0)
    assert np.allclose(lattice.vertices, [[3, -4, np.pi]]) and lattice.nedges == 0


def test_vertices_are_named_after_the_moves_that_first_reached_them():
    lattice = LatticePlanner(root=(5, 5, 0))
    lattice.plan(4)
    _, status = lattice.query((6, 5, 0), (7, 6, np.pi / 2))
    assert str(status.edges) == '[Edge{[0S] -- [0SL], cost=1.571}]'


def test_from_a_start_to_itself_is_one_configuration():
    path, status = LatticePlanner(occgrid=np.zeros((3, 3))).query((1, 1, 0), (1, 1, 0))
    assert path.tolist() == [[1, 1, 0]] and status == (0.0, [], [])


def test_costs_weigh_left_against_right():
    grid = np.zeros((9, 9))
    around_left = LatticePlanner((1, 1, 100), occgrid=grid).query((4, 4, 0), (4, 2, -np.pi))[1]
    assert 'R' not in around_left.segments and set(around_left.segments) >= {'L'}


def test_backwards_is_allowed_for_a_price():
    grid = np.zeros((1, 9))
    with pytest.raises(NoPath):
        LatticePlanner(occgrid=grid).query((5, 0, 0), (2, 0, 0))
    path, status = LatticePlanner(occgrid=grid, reverse_cost=2.5).query((5, 0, 0), (2, 0, 0))
    assert status.segments == ['s', 's', 's'] and status.cost == 7.5 and (path[:, 2] == 0).all()


def test_a_turn_cost_prefers_the_straight_way():
    grid = np.zeros((12, 12))
    turns = [sum(s != 'S' for s in LatticePlanner(occgrid=grid, headings=8, turn_cost=cost).query(
        (1, 1, 0), (10, 6))[1].segments) for cost in (0.0, 50.0)]
    assert turns[1] <= turns[0]


def test_ends_are_configurations_of_the_lattice():
    lattice = LatticePlanner(occgrid=[[0, 0, 1], [0, 0, 0]], headings=16)
    with pytest.raises(InvalidInput, match='nearest is 0.463'):
        lattice.query((0, 0, 0.4), (1, 1, 0))
    assert np.allclose(lattice.nearest((0.3, 0.6, 0.4)), (0, 1, np.arctan2(1, 2)))
    for pose in ((1, 2), 'q', (0, 0, np.nan)):
        with pytest.raises(InvalidInput):
            lattice.nearest(pose)
    for start in ((0, 0), (0, 0, np.nan), (0, 0, 0, 0), 'abc', None):
        with pytest.raises(InvalidInput):
            lattice.query(start, (1, 1, 0))
    with pytest.raises(StartOutside):
        lattice.query((-1, 0, 0), (1, 1, 0))
    with pytest.raises(StartOccupied):
        lattice.query((2, 0, 0), (1, 1, 0))
    with pytest.raises(GoalOutside):
        lattice.query((0, 0, 0), (3, 0, 0))
    with pytest.raises(GoalOccupied):
        lattice.query((0, 0, 0), (2, 0))


def test_the_root_must_be_free():
    with pytest.raises(StartOccupied, match='root'):
        LatticePlanner(root=(1, 0, 0), occgrid=[[0, 1]]).plan()
    with pytest.raises(StartOutside, match='root'):
        LatticePlanner(root=(0, 1, 0), occgrid=[[0, 1]]).plan()


def test_without_a_grid_the_iterations_must_be_given_and_a_query_wants_a_plan():
    with pytest.raises(InvalidInput, match='iterations'):
        LatticePlanner().plan()
    with pytest.raises(RuntimeError, match='plan()'):
        LatticePlanner().query((0, 0, 0), (1, 0, 0))
    for wrong in (-1, 1.5, 'two', np.inf, np.nan, [1, 2]):
        with pytest.raises(InvalidInput, match='iterations'):
            LatticePlanner().plan(wrong)
    with pytest.raises(LimitExceeded):
        LatticePlanner().plan(10 ** 6)


@pytest.mark.parametrize('options', [
    {'costs': (1, 2)}, {'costs': (0, 1, 1)}, {'costs': (1, 1, np.inf)}, {'turn_cost': -1}, {'reverse_cost': 0},
    {'costs': 'abc'}, {'turn_cost': 'a'}, {'reverse_cost': np.nan}, {'headings': 5}, {'radius': 0}, {'radius': 'a'}])
def test_options_are_checked(options):
    with pytest.raises(InvalidInput):
        LatticePlanner(**options)


def test_a_map_leaks_nowhere():
    lattice = LatticePlanner(occgrid=np.zeros((6, 6)))
    lattice.plan()
    assert len(lattice.vertices) == 121 and lattice.nedges == 258  # counted by roboticstoolbox 1.5.0
    assert (lattice.vertices[:, :2] >= 0).all() and (lattice.vertices[:, :2] <= 5).all()


def test_a_stopped_plan_leaves_the_one_before_and_a_query_stops_too():
    lattice = LatticePlanner(occgrid=np.zeros((80, 80)), headings=16)
    lattice.plan(3)
    before = len(lattice.vertices)
    with pytest.raises(Cancelled):
        lattice.plan(stop=np.ones(1, np.uint8))
    assert len(lattice.vertices) == before
    with pytest.raises(Cancelled):
        lattice.query((0, 0, 0), (1, 1), stop=np.ones(1, np.uint8))


def test_an_occupancy_grid_is_planned_on_in_cells_and_inflated():
    grid = OccupancyGrid(np.array([[0, 0, 0, 0, 100]], np.int8), resolution=0.1, origin=(5, 5, 1))
    lattice = LatticePlanner(occgrid=grid, inflate=1)
    assert lattice.query((0, 0, 0), (2, 0, 0))[1].segments == ['S', 'S']
    with pytest.raises(GoalOccupied):
        lattice.query((0, 0, 0), (3, 0, 0))


def test_the_lattice_can_be_told_and_drawn(tmp_path, capsys):
    lattice = LatticePlanner(occgrid=np.zeros((8, 8)), headings=8, reverse_cost=2.0, root=(3, 3, 0))
    lattice.plan(summary=True)
    assert 'vertices' in capsys.readouterr().out and 'headings: 8' in str(lattice)
    path, _ = lattice.query((3, 3, 0), (3, 5, np.pi))
    for configspace in (False, True):
        axes = lattice.plot(path, configspace=configspace)
        axes.figure.savefig(tmp_path / 'lattice.png')
    lattice.plan(1, movie=(tmp_path / 'plan.gif', 0.1))
    lattice.query((3, 3, 0), (4, 3, 0), movie=tmp_path / 'path.gif')
    assert (tmp_path / 'plan.gif').read_bytes()[:3] == (tmp_path / 'path.gif').read_bytes()[:3] == b'GIF'
