"""Pebbles on plain graphs for tests: instances, and what can be said of them by looking at all there is."""
import numpy as np
from hypothesis import strategies as st

from mobile_planning.fleet import pebbles
from mobile_planning.fleet.pebbles import Instance


def graph_instance(edges, starts, goals):
    """Return an instance on a plain graph, where robots meet only at places, or face to face on an edge."""
    edges = np.array(edges, np.int64).reshape(-1, 2)
    count = int(max(edges.max(), *starts, *goals)) + 1
    to_go = np.full((len(goals), count), np.inf)
    for robot, goal in enumerate(goals):
        to_go[robot, goal] = 0.0
        for _ in range(count):
            for u, v in edges:
                to_go[robot, u] = min(to_go[robot, u], to_go[robot, v] + 1)
                to_go[robot, v] = min(to_go[robot, v], to_go[robot, u] + 1)
    swept = np.zeros((1, len(edges), count), bool)
    swept[0, np.arange(len(edges))[:, None], edges] = True
    return Instance(edges, np.ones(len(edges)), np.array(starts), np.array(goals),
                    np.ones((len(starts), len(edges)), bool), to_go, np.zeros((len(starts),) * 2, np.int64),
                    np.eye(count, dtype=bool)[None], swept)


def can_be_solved(instance):
    """Whether moves of one robot at a time lead from the starts to the goals, by looking at all configurations."""
    neighbours = {}
    for (u, v), e in zip(instance.edges.tolist(), range(len(instance.edges))):
        neighbours.setdefault(u, []).append((v, e))
        neighbours.setdefault(v, []).append((u, e))
    start, goal = tuple(instance.starts.tolist()), tuple(instance.goals.tolist())
    known, front = {start}, [start]
    while front:
        here = front.pop()
        if here == goal:
            return True
        for robot, place in enumerate(here):
            for v, e in neighbours.get(place, []):
                others = [w for other, w in enumerate(here) if other != robot]
                there = (*here[:robot], v, *here[robot + 1:])
                if there not in known and not any(instance.swept[0, e, w] or instance.close[0, v, w] for w in others):
                    known.add(there)
                    front.append(there)
    return False


def play(instance, steps):
    """Play all moves one at a time in the order of their ranks; fail if one meets a robot that stands."""
    here, turns = instance.starts.copy(), pebbles.ranks(instance, steps)
    assert turns is not None
    for t in range(len(steps.edges)):
        for robot in np.argsort(turns[t], kind='stable'):
            e, v = steps.edges[t, robot], steps.places[t + 1, robot]
            if e < 0:
                assert v == here[robot]
                continue
            assert set(instance.edges[e]) == {here[robot], v} and instance.usable[robot, e]
            for other in range(instance.count):
                kind = instance.kinds[robot, other]
                assert other == robot or not instance.swept[kind, e, here[other]]
            here[robot] = v
    assert np.array_equal(here, steps.places[-1])
    return here


@st.composite
def small_instances(draw):
    places = draw(st.integers(3, 6))
    edges = [(draw(st.integers(0, v - 1)), v) for v in range(1, places)]
    edges += draw(st.lists(st.tuples(st.integers(0, places - 1), st.integers(0, places - 1)), max_size=2))
    edges = sorted({tuple(sorted(edge)) for edge in edges if edge[0] != edge[1]})
    robots = draw(st.integers(1, min(4, places)))
    starts, goals = (draw(st.permutations(range(places)))[:robots] for _ in range(2))
    return graph_instance(edges, starts, goals)
