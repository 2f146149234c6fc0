"""Roadmaps as files: the same comes back, and nothing that is no roadmap gets in."""
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import Boundary, Environment, RoundObstacle
from mobile_planning.errors import InvalidInput, NotBuilt
from mobile_planning.sampling.prm import PRMPlanner
from mobile_planning.sampling.prm_options import CollisionCheckingStrategy

WORLD = Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 2)])


@pytest.fixture
def planner():
    """Return a planner with a roadmap of 60 nodes."""
    planner = PRMPlanner(WORLD)
    planner.build_roadmap(60, seed=4)
    return planner


@pytest.mark.parametrize('checking', CollisionCheckingStrategy)
@pytest.mark.parametrize('radius', [None, 0.7])
def test_what_is_saved_is_loaded(tmp_path, checking, radius):
    saved, loaded = (PRMPlanner(WORLD, collision_checking=checking, turning_radius=radius) for _ in range(2))
    saved.build_roadmap(200, seed=4)
    saved.save(tmp_path / 'roadmap.npz')
    loaded.load(tmp_path / 'roadmap.npz')
    for name in ('points', 'edges', 'lengths', 'radius', 'is_directed', 'node_states', 'edge_states'):
        assert np.array_equal(getattr(saved.roadmap, name), getattr(loaded.roadmap, name)), name
    start, goal = ((1, 1, 0)[:2 if radius is None else 3], (9, 9, 0)[:2 if radius is None else 3])
    assert saved.query(start, goal).cost == loaded.query(start, goal).cost
    assert loaded.seed == 4
    loaded.extend(50)
    assert loaded.statistics().nodes == 250


def test_what_was_learnt_among_other_obstacles_is_not_believed(tmp_path, planner):
    planner.query((1, 5), (9, 5))
    planner.save(tmp_path / 'roadmap.npz')
    blocked = Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 4)])
    for checking in CollisionCheckingStrategy:
        other = PRMPlanner(blocked, collision_checking=checking)
        other.load(tmp_path / 'roadmap.npz')
        path = other.query((0.5, 5), (9.5, 5)).path
        assert len(path) and blocked.free_poses(path).all()


def contents(planner, **changes):
    """Return what a file holds, with changes."""
    roadmap = planner.roadmap
    return {'format': 1, 'kind': 'plane', 'seed': 4, 'radius': roadmap.radius, 'points': roadmap.points,
            'edges': roadmap.edges.astype(np.int32), **changes}


BAD = {
    'another format': {'format': 2}, 'another space': {'kind': 'Dubins paths of radius 1.0 m'},
    'a point outside': {'points': np.full((60, 2), 11.0)}, 'points as whole numbers': {'points': np.ones((60, 2), int)},
    'a point that is no number': {'points': np.full((60, 2), np.nan)}, 'points in space': {'points': np.zeros((60, 3))},
    'a node that is not there': {'edges': np.array([[0, 60]])}, 'a node below 0': {'edges': np.array([[-1, 5]])},
    'a loop': {'edges': np.array([[3, 3]])}, 'an edge backwards': {'edges': np.array([[4, 3]])},
    'edges as floats': {'edges': np.array([[0.0, 1.0]])}, 'edges of three': {'edges': np.zeros((4, 3), int)},
    'flat edges': {'edges': np.zeros(4, int)}, 'no radius': {'radius': 0.0}, 'a bad radius': {'radius': np.nan},
    'a radius below the edges': {'radius': 1e-3}, 'objects': {'points': np.array([{}, {}])},
    'a seed that is none': {'seed': 0.5}, 'a format in words': {'format': 'one'}}


@pytest.mark.parametrize('name', BAD)
def test_a_file_that_is_no_roadmap_is_refused_and_changes_nothing(tmp_path, planner, name):
    before = planner.roadmap
    np.savez(tmp_path / 'bad.npz', **contents(planner, **BAD[name]))
    with pytest.raises(InvalidInput):
        planner.load(tmp_path / 'bad.npz')
    assert planner.roadmap is before


def test_an_edge_that_is_there_twice_is_refused(tmp_path, planner):
    edges = planner.roadmap.edges
    np.savez(tmp_path / 'bad.npz', **contents(planner, edges=np.concatenate([edges, edges[:1]])))
    with pytest.raises(InvalidInput):
        planner.load(tmp_path / 'bad.npz')


def test_a_file_without_a_part_or_compressed_is_refused(tmp_path, planner):
    for name in contents(planner):
        rest = contents(planner)
        del rest[name]
        np.savez(tmp_path / 'bad.npz', **rest)
        with pytest.raises(InvalidInput):
            planner.load(tmp_path / 'bad.npz')
    np.savez_compressed(tmp_path / 'bad.npz', **contents(planner))
    with pytest.raises(InvalidInput):
        planner.load(tmp_path / 'bad.npz')
    with zipfile.ZipFile(tmp_path / 'bad.npz', 'w') as archive:
        archive.writestr('points.npy', b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, "
                                       b"'shape': (99999999999999, 2), }" + b' ' * 42 + b'\n')
    with pytest.raises(InvalidInput):
        planner.load(tmp_path / 'bad.npz')


@settings(max_examples=60)
@given(st.data())
def test_a_damaged_file_is_refused_or_makes_a_sound_roadmap(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp('damaged')
    planner = PRMPlanner(WORLD)
    planner.build_roadmap(20, seed=4)
    planner.save(folder / 'roadmap.npz')
    whole = bytearray((folder / 'roadmap.npz').read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    (folder / 'roadmap.npz').write_bytes(whole[:data.draw(st.integers(0, len(whole)))])
    try:
        planner.load(folder / 'roadmap.npz')
    except InvalidInput:
        return
    path = planner.query((1, 1), (9, 9)).path
    assert WORLD.free_poses(path).all()


def test_a_file_that_cannot_be_is_told_by_the_system(tmp_path, planner):
    with pytest.raises(FileNotFoundError):
        planner.load(tmp_path / 'nowhere.npz')
    with pytest.raises(FileNotFoundError):
        planner.save(tmp_path / 'nowhere' / 'roadmap.npz')
    with pytest.raises(NotBuilt):
        PRMPlanner(WORLD).save(tmp_path / 'roadmap.npz')
    assert list(tmp_path.iterdir()) == []
