"""Families: how the worlds and the missions of ``scenarios`` are drawn.

Each family is a function of its name, a random generator and its own parameters, already checked, that returns a scene.
"""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.free_places import FreePlaces
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.map_io import load_map
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle

#: Radius of every robot [m].
RADIUS = 0.2
#: Places are at least so far apart [m]: both bodies, and 25 mm of margin each.
_APART = 2 * RADIUS + 0.05
#: Of a maze: so many rooms in a row, the side of one, its walls and doors [m].
_ROOMS, _SIDE, _WALL, _DOOR = 3, 2.6, 0.2, 0.65


def heritage(name: str, rng: np.random.Generator) -> Scene:
    """Return the two robots of the first receding-horizon planner's script, at rest at both ends."""
    circles = [RoundObstacle((0.55, 1.91), 0.314), RoundObstacle((-0.08, 3.65), 0.325),
               RoundObstacle((0.38, 4.65), 0.165)]
    environment = Environment(Boundary((-4.0, 4.0), (-2.0, 9.0)), circles)
    starts, goals = np.array([(-0.05, 0.0), (0.4, 0.0)]), np.array([(0.1, 7.0), (-0.4, 5.0)])
    scene = _scene(name, environment, starts, goals, np.full(2, np.pi / 2))
    return replace(scene, horizon={'N_s': 14, 'n_knots': 5, 'Tc': 0.5, 'Tp': 2.0, 'Td': 2.0, 'detec_rho': 6.0,
                                   'def_epsilon': 5.0})


def swap(name: str, rng: np.random.Generator, robots: int, jitter: float, radius: float | None) -> Scene:
    """Return robots on a circle, each of which drives to the place opposite."""
    radius = max(3.0, robots / 4) if radius is None else radius
    # Two neighbours may both have come nearer to each other by the diagonal of their jitter.
    distance, need = 2 * radius * np.sin(np.pi / max(robots, 2)), _APART + 2 * np.sqrt(2) * jitter
    if robots > 1 and distance < need:
        raise InvalidInput(f'{robots} robots on a circle of radius {radius:g} m are {distance:.3f} m apart; '
                           f'with a jitter of {jitter:g} m they need {need:.3f} m')
    angles = 2 * np.pi * np.arange(robots) / robots
    places = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return _scene(name, _open_space(radius + jitter + 3.0, radius + jitter + 3.0),
                  places + rng.uniform(-jitter, jitter, places.shape), -places)


def line_swap(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return two rows 6 m apart, 0.9 m from robot to robot, where each robot drives to the place it faces."""
    if robots % 2:
        raise InvalidInput(f'robots is {robots}, not an even number')
    y = 0.9 * (np.arange(robots // 2) - (robots // 2 - 1) / 2)
    left, right = (np.column_stack([np.full(robots // 2, x), y]) + rng.uniform(-0.1, 0.1, (robots // 2, 2))
                   for x in (-3.0, 3.0))
    return _scene(name, _open_space(6.0, y[-1] + 3.0), np.concatenate([left, right]), np.concatenate([right, left]))


def forest(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return trips of 6 m or more between 20 round obstacles that are 0.7 m or more apart."""
    centres, radii = np.empty((0, 2)), np.empty(0)
    while len(radii) < 20:
        centre, radius = rng.uniform(-4.2, 4.2, 2), rng.uniform(0.2, 0.5)
        if (np.linalg.norm(centres - centre, axis=1) - radii - radius >= 0.7).all():
            centres, radii = np.vstack([centres, centre]), np.append(radii, radius)
    environment = Environment(Boundary((-6.0, 6.0), (-6.0, 6.0)), map(RoundObstacle, centres, radii))
    places = FreePlaces(rng, environment, RADIUS, 0.15)
    inside = (np.abs(places.points) <= 5.0).all(axis=1)
    return _scene(name, environment, *places.missions(robots, 0.8, 6.0, inside, inside))


def doorway(name: str, rng: np.random.Generator, robots: int, gap: float) -> Scene:
    """Return a room of 8 m x 6 m divided by a wall with a door, robots by turns from the left and from the right."""
    environment = Environment(Boundary((-4.0, 4.0), (-3.0, 3.0)),
                              [_box(-0.1, -3.0, 0.1, -gap / 2), _box(-0.1, gap / 2, 0.1, 3.0)])
    places = FreePlaces(rng, environment, RADIUS, 0.35)
    beyond = np.outer(_directions(robots), places.points[:, 0])
    return _scene(name, environment, *places.missions(robots, 0.9, 0.0, beyond <= -1.2, beyond >= 1.2))


def corridor(name: str, rng: np.random.Generator, robots: int, width: float) -> Scene:
    """Return two rooms of 2 m x 4 m joined by a corridor of 4 m, robots by turns from the left and from the right."""
    environment = Environment(Boundary((-4.0, 4.0), (-2.0, 2.0)),
                              [_box(-2.0, -2.0, 2.0, -width / 2), _box(-2.0, width / 2, 2.0, 2.0)])
    rows = np.arange(robots) // 2
    y = 0.9 * (rows - rows[-1] / 2) + rng.uniform(-0.1, 0.1, robots)
    starts = np.column_stack([-3.2 * _directions(robots), y])
    return _scene(name, environment, starts, -starts)


def intersection(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return two streets of 2.4 m that cross, robots on the right of each arm, bound for the right of another one."""
    half, street, arms = 5.0, 1.2, np.pi / 2 * np.arange(4)
    corners = [_box(*np.minimum(street * side, half * side), *np.maximum(street * side, half * side))
               for side in np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])]
    starts, goals = [], []
    for distance in 4.4 - 0.8 * np.arange(-(-robots // 4)):
        # Four at a time, one from each arm; who starts nearest to the crossing drives farthest beyond it.
        starts.append(_on_the_right(arms + np.pi, -distance))
        goals.insert(0, _on_the_right(arms[_derangement(rng, 4)], distance))
    starts, goals = (np.concatenate(places)[:robots] + rng.uniform(-0.1, 0.1, (robots, 2))
                     for places in (starts, goals))
    return _scene(name, Environment(Boundary((-half, half), (-half, half)), corners), starts, goals)


def maze(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return 3 x 3 rooms joined by doors that make a random tree, and trips from room to room."""
    tree = _random_tree(rng, _ROOMS)
    middles = rng.uniform(0.7, _SIDE - 0.7, len(tree))
    return _from_room_to_room(name, rng, robots, {
        pair: float(middle) if is_joined else None for (pair, is_joined), middle in zip(tree.items(), middles)})


def rooms(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return 3 x 3 rooms joined by the same doors for every seed, a tree, and trips from room to room."""
    walls = dict.fromkeys(_neighbours(_ROOMS))
    doors = {((0, 0), (1, 0)): 0.8, ((0, 1), (1, 1)): 1.8, ((0, 2), (1, 2)): 1.3, ((1, 0), (2, 0)): 1.8,
             ((1, 1), (2, 1)): 0.8, ((1, 0), (1, 1)): 1.3, ((0, 1), (0, 2)): 0.8, ((2, 1), (2, 2)): 1.8}
    return _from_room_to_room(name, rng, robots, walls | doors)


def _from_room_to_room(name, rng, robots, doors):
    """Return trips through rooms; ``doors`` says where [m] in the wall of each pair of rooms (x, y) its door is."""
    walls = []
    for (a, b), middle in doors.items():
        ends = (0.0, _SIDE) if middle is None else (0.0, middle - _DOOR / 2, middle + _DOOR / 2, _SIDE)
        for low, high in zip(ends[::2], ends[1::2]):
            if a[1] == b[1]:
                walls.append(_box(b[0] * _SIDE - _WALL / 2, a[1] * _SIDE + low,
                                  b[0] * _SIDE + _WALL / 2, a[1] * _SIDE + high))
            else:
                walls.append(_box(a[0] * _SIDE + low, b[1] * _SIDE - _WALL / 2,
                                  a[0] * _SIDE + high, b[1] * _SIDE + _WALL / 2))
    environment = Environment(Boundary((0.0, _ROOMS * _SIDE), (0.0, _ROOMS * _SIDE)), walls)
    # With so much room, places in one room are less than 1.85 m apart.
    return _scene(name, environment, *FreePlaces(rng, environment, RADIUS, 0.4).missions(robots, 0.9, 1.85))


def pockets(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return two rooms joined by a lane of 6 m x 0.65 m with three dead ends, a trap before each of its mouths.

    A trap is a wall with two arms, open to its room: who goes straight to the lane drives into it. Robots start by
    turns behind the traps on the left and on the right.
    """
    walls = []
    for side, middles in ((1.0, (-1.8, 1.8)), (-1.0, (0.0,))):
        left = -3.0
        for middle in middles:
            # From pocket to pocket the lane's wall, and the end of the pocket 0.7 m deep.
            walls += [_beside(left, middle - 0.35, side, 0.325), _beside(middle - 0.35, middle + 0.35, side, 1.025)]
            left = middle + 0.35
        walls.append(_beside(left, 3.0, side, 0.325))
    for side in (-1.0, 1.0):
        for near, far, low, high in ((3.85, 3.95, -0.6, 0.6), (3.85, 4.35, 0.5, 0.6), (3.85, 4.35, -0.6, -0.5)):
            walls.append(_box(*sorted((side * near, side * far))[:1], low, max(side * near, side * far), high))
    environment = Environment(Boundary((-5.4, 5.4), (-2.0, 2.0)), walls)
    places = FreePlaces(rng, environment, RADIUS, 0.1)
    beyond = np.outer(_directions(robots), places.points[:, 0])
    return _scene(name, environment, *places.missions(robots, 0.8, 0.0, beyond <= -4.6, beyond >= 4.6))


def _beside(x_min, x_max, side, y):
    """Return the wall from ``y`` to the room's edge [m], above the lane for a ``side`` of 1, else below."""
    return _box(x_min, *sorted((side * y, side * 2.0))[:1], x_max, max(side * y, side * 2.0))


def warehouse(name: str, rng: np.random.Generator, robots: int, aisle: float) -> Scene:
    """Return trips of 4 m or more between two columns of four shelves of 4 m x 0.8 m."""
    shelves = [_box(x, y, x + 4.0, y + 0.8) for x in (1.6, 7.2) for y in aisle + (0.8 + aisle) * np.arange(4)]
    environment = Environment(Boundary((0.0, 12.8), (0.0, 3.2 + 5 * aisle)), shelves)
    return _scene(name, environment, *FreePlaces(rng, environment, RADIUS, 0.15).missions(robots, 0.9, 4.0))


def depot(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return random missions on the map of the depot."""
    path = _shipped('maps', 'depot.yaml')
    return random_missions(name, rng, robots, grid=load_map(path), map_path=path)


def hall(name: str, rng: np.random.Generator, robots: int) -> Scene:
    """Return robots on a circle anywhere on the map of the depot, each of which drives to the place opposite."""
    path = _shipped('maps', 'depot.yaml')
    grid = load_map(path)
    free = cKDTree(FreePlaces(rng, Environment(grid=grid), RADIUS, 0.2).points)
    angles, radius = 2 * np.pi * np.arange(robots) / robots, max(2.5, robots / 4)
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    while True:
        middle = rng.uniform(free.mins, free.maxes)
        # What else is in the circle they go round.
        _, starts = free.query(middle + circle + rng.uniform(-0.1, 0.1, circle.shape), distance_upper_bound=0.1)
        _, goals = free.query(middle - circle, distance_upper_bound=0.1)
        if max(starts.max(), goals.max()) < free.n:
            return _scene(name, Environment(grid=grid), free.data[starts], free.data[goals], map_path=path)


def random_missions(name: str, rng: np.random.Generator, robots: int, *, boundary=None, obstacles=(), grid=None,
                    map_path: Path | None = None) -> Scene:
    """Return random missions in any world; starts are 1 m apart, goals too, and trips 6 m or more if it is that large.

    Raises
    ------
    InvalidInput
        The world has no extent or no room.
    """
    environment = Environment(boundary, obstacles, grid)
    x_min, y_min, x_max, y_max = environment.bounds
    trip = min(6.0, 0.4 * max(x_max - x_min, y_max - y_min))
    places = FreePlaces(rng, environment, RADIUS, 0.2).missions(robots, 1.0, trip)
    return _scene(name, environment, *places, map_path=map_path)


def _scene(name, environment, starts, goals, headings=None, map_path=None):
    """Return the scene of robots from ``starts`` to ``goals`` (N, 2) [m] that look along ``headings`` (N,) at both."""
    trips = goals - starts
    if headings is None:
        headings = np.arctan2(trips[:, 1], trips[:, 0])
    starts, goals = (np.column_stack([places, headings]).tolist() for places in (starts, goals))
    specs = tuple(RobotSpec(index + 1, tuple(start), tuple(goal), RADIUS)
                  for index, (start, goal) in enumerate(zip(starts, goals)))
    return Scene(name, specs, environment.obstacles, environment.boundary, environment.grid, map_path,
                 on_map=environment.grid is not None, timeout=max(60.0, 8.0 * float(np.hypot(*trips.T).max())))


def _open_space(x: float, y: float) -> Environment:
    return Environment(Boundary((-x, x), (-y, y)))


def _box(x_min, y_min, x_max, y_max):
    return PolygonObstacle([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def _directions(robots):
    """Return 1 for every robot that drives to the right and -1 for the others (N,), by turns."""
    return 1 - 2 * (np.arange(robots) % 2)


def _on_the_right(angles, distance) -> NDArray:
    """Return places (N, 2) [m] at ``distance`` along rays from the origin, on the right of the middle of the street."""
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    return distance * along + 0.6 * along[:, ::-1] * (1, -1)


def _derangement(rng, count):
    """Return a random order (count,) that leaves nobody in his place."""
    while True:
        order = rng.permutation(count)
        if (order != np.arange(count)).all():
            return order


def _neighbours(rooms):
    """Return all pairs of neighbours among ``rooms`` x ``rooms`` rooms (x, y)."""
    return [((x, y), (x + dx, y + dy)) for x in range(rooms) for y in range(rooms) for dx, dy in ((1, 0), (0, 1))
            if x + dx < rooms and y + dy < rooms]


def _random_tree(rng, rooms):
    """Return for each pair of neighbours among ``rooms`` x ``rooms`` rooms (x, y) whether a random tree joins them."""
    pairs = _neighbours(rooms)
    cells = {cell for pair in pairs for cell in pair}
    tree_of, joined = {cell: cell for cell in cells}, {}
    for index in rng.permutation(len(pairs)):
        a, b = pairs[index]
        joined[a, b] = tree_of[a] != tree_of[b]
        absorbed = tree_of[a]
        tree_of = {cell: tree_of[b] if tree == absorbed else tree for cell, tree in tree_of.items()}
    return joined


def _shipped(*names):
    """Return where a file of ``config`` is: beside the package in the source tree, under ``share`` where installed."""
    package = Path(__file__).resolve().parents[1]
    homes = [package.parent, *(folder / 'share' / package.name for folder in package.parents)]
    files = [home.joinpath('config', *names) for home in homes]
    return next((file for file in files if file.is_file()), files[0])
