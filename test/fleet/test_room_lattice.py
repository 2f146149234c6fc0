"""The lattice beneath a roadmap: its rooms are those of the world, and its neighbourhoods those of shortest ways."""
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from mobile_planning import Boundary, Environment, RoundObstacle
from mobile_planning.fleet.room_lattice import Neighbourhoods, RoomLattice

NEED, CELL = 0.22, 0.05
CIRCLES = st.lists(st.tuples(st.floats(0, 3), st.floats(0, 2), st.floats(0.05, 0.6)), max_size=5)


def lattice_of(circles):
    world = Environment(Boundary((0, 3), (0, 2)), [RoundObstacle((x, y), radius) for x, y, radius in circles])
    return world, RoomLattice(world, NEED, CELL)


def moves(steps):
    """Return the graph of the steps, by what a step from each node leads to."""
    height, width = steps.shape[1:]
    numbers, rows = np.arange(height * width).reshape(height, width), []
    ways = [(0, 1), (1, 0), (1, 1), (1, -1)]
    for move, (down, right) in enumerate([*ways, *((-a, -b) for a, b in ways)]):
        row, column = np.nonzero(steps[move])
        rows.append(np.column_stack([numbers[row, column], numbers[row + down, column + right],
                                     steps[move, row, column]]))
    a, b, cost = np.concatenate(rows).T
    return csr_matrix((cost.astype(float), (a, b)), shape=(numbers.size,) * 2)


@settings(max_examples=20, deadline=None)
@given(CIRCLES)
def test_nodes_stay_in_their_squares_and_know_the_room_where_they_are(circles):
    world, lattice = lattice_of(circles)
    assert np.allclose(lattice.rooms, world.clearance(lattice.places))
    columns, rows = lattice.cells(lattice.places.reshape(-1, 2)).T
    assert np.array_equal(rows * lattice.rooms.shape[1] + columns, np.arange(lattice.rooms.size))


@settings(max_examples=20, deadline=None)
@given(CIRCLES)
def test_between_nodes_that_a_step_joins_a_body_has_room_all_the_way(circles):
    world, lattice = lattice_of(circles)
    a, b = moves(lattice.steps()).nonzero()
    a, b = lattice.places.reshape(-1, 2)[a], lattice.places.reshape(-1, 2)[b]
    for share in np.linspace(0, 1, 21):
        # Between the places that are looked at there may be less by the height of an arc of a centimetre or two.
        assert (world.clearance(a + share * (b - a)) >= NEED - 0.001).all()


@settings(max_examples=20, deadline=None)
@given(CIRCLES, st.integers(1, 6), st.integers(0, 100))
def test_ways_between_neighbourhoods_are_shortest_ways_and_join_all_that_is_joined(circles, count, seed):
    _, lattice = lattice_of(circles)
    graph = moves(lattice.steps())
    free = np.flatnonzero(lattice.rooms.ravel() >= NEED)
    if len(free) < count:
        return
    sources = np.random.default_rng(seed).choice(free, count, replace=False)
    around = Neighbourhoods(lattice, sources)
    exact = dijkstra(graph, indices=sources)[:, sources]
    joined = np.full((count, count), np.inf)
    places = lattice.places.reshape(-1, 2)
    for index, (a, b) in enumerate(around.pairs):
        way = around.way(index)
        assert np.array_equal(way[[0, -1]], places[sources[[a, b]]])
        columns, rows = lattice.cells(way).T
        nodes = rows * lattice.rooms.shape[1] + columns
        cost = np.asarray(graph[nodes[:-1], nodes[1:]]).ravel()
        assert (cost > 0).all()
        joined[a, b] = joined[b, a] = cost.sum()
    # By way of neighbours, everything costs what it costs straight on at least, and is there if anything is.
    over = dijkstra(np.where(np.isfinite(joined), joined, 0.0))
    assert np.array_equal(np.isfinite(over), np.isfinite(exact)) and (over >= exact).all()
    # Who is nearest to somebody touches him.
    apart = np.where(np.eye(count, dtype=bool), np.inf, exact)
    nearest = np.isfinite(apart.min(axis=1, initial=np.inf))
    assert np.allclose(joined.min(axis=1, initial=np.inf)[nearest], apart.min(axis=1, initial=np.inf)[nearest])
