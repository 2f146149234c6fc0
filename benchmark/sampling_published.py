"""Two published Python planners over Dubins paths, restated as they work.

RRT-Dubins (github.com/FelicienC/RRT-Dubins, 2024): the six words are constructed from the centres of the turning
circles as small arrays, for every node of the tree; points 1 m apart are asked of shapely, among the five obstacles
whose centres are nearest. PythonRobotics: the nearest node by the line, its shortest word, points a tenth of a radius
apart, asked of all obstacles.
"""
import math
import random
import time

import numpy as np
import shapely
from scipy.spatial import KDTree

TAU = 2 * np.pi
# Larger shapes are not found by their centres.
_SMALL = 0.2


class Shapes:
    """The obstacles of a problem as shapely has them."""

    def __init__(self, problem):
        self.bounds = problem.environment.bounds
        self.polygons = [shapely.Point(*shape.centroid).buffer(shape.radius) if hasattr(shape, 'radius')
                         else shapely.Polygon(shape.vertices) for shape in problem.environment.obstacles]
        widest = max(math.hypot(shape.bounds[2] - shape.bounds[0], shape.bounds[3] - shape.bounds[1])
                     for shape in self.polygons)
        self.are_small = widest < _SMALL * (self.bounds[2] - self.bounds[0])
        self._centres = KDTree([(shape.centroid.x, shape.centroid.y) for shape in self.polygons])

    def is_free(self, x, y):
        """Return whether a point is free of the five nearest obstacles, or of all if they are large."""
        if not (self.bounds[0] <= x <= self.bounds[2] and self.bounds[1] <= y <= self.bounds[3]):
            return False
        point = shapely.Point(x, y)
        near = self.polygons
        if self.are_small:
            near = [self.polygons[k] for k in self._centres.query((x, y), min(5, len(self.polygons)))[1]]
        return not any(shape.contains(point) for shape in near)


def centre(pose, side, radius):
    """Return the centre of the circle on which a car turns left (1) or right (-1)."""
    angle = pose[2] + side * np.pi / 2
    return np.array([pose[0] + radius * np.cos(angle), pose[1] + radius * np.sin(angle)])


def words(start, goal, radius):
    """Return (length, turns, (first, middle, last)) of each word from start to goal; arcs [rad], straights [radii]."""
    return [word for word in (
        kind(start, goal, side, radius) for kind in (outer, inner, triple) for side in (1, -1)) if word is not None]


def outer(start, goal, side, radius):
    """Return LSL or RSR."""
    line = centre(goal, side, radius) - centre(start, side, radius)
    distance, direction = np.linalg.norm(line), np.arctan2(line[1], line[0])
    first, last = side * (direction - start[2]) % TAU, side * (goal[2] - direction) % TAU
    return radius * (first + last) + distance, (side, 0, side), (first, distance / radius, last)


def inner(start, goal, side, radius):
    """Return LSR or RSL, None if the circles are too near."""
    line = centre(goal, -side, radius) - centre(start, side, radius)
    distance = np.linalg.norm(line)
    if distance < 2 * radius:
        return None
    straight = np.sqrt(distance**2 - 4 * radius**2)
    direction = np.arctan2(line[1], line[0]) + side * np.arctan2(2 * radius, straight)
    first, last = side * (direction - start[2]) % TAU, side * (direction - goal[2]) % TAU
    return radius * (first + last) + straight, (side, 0, -side), (first, straight / radius, last)


def triple(start, goal, side, radius):
    """Return LRL or RLR, None if the circles are too far apart."""
    begin, end = centre(start, side, radius), centre(goal, side, radius)
    line = end - begin
    distance = np.linalg.norm(line)
    if distance > 4 * radius:
        return None
    direction, found = np.arctan2(line[1], line[0]), []
    for bend in (1, -1):
        to_middle = direction + bend * np.arccos(distance / (4 * radius))
        middle = begin + 2 * radius * np.array([np.cos(to_middle), np.sin(to_middle)])
        from_middle = np.arctan2(end[1] - middle[1], end[0] - middle[0])
        first = side * (to_middle + side * np.pi / 2 - start[2]) % TAU
        second = -side * (from_middle - to_middle - np.pi) % TAU
        last = side * (goal[2] - from_middle + side * np.pi / 2) % TAU
        # With less than half a circle in the middle it is never the shortest word.
        found.append((second < np.pi, radius * (first + second + last), (side, -side, side), (first, second, last)))
    return min(found)[1:]


def points_along(start, turns, parts, radius, spacing):
    """Return points (x, y) so far apart along a word, the end among them."""
    x, y, heading = start
    points = []
    for turn, part in zip(turns, parts):
        count = max(1, math.ceil(part * radius / spacing))
        for s in np.linspace(0, part, count + 1)[1:]:
            if turn == 0:
                points.append((x + radius * s * np.cos(heading), y + radius * s * np.sin(heading)))
            else:
                points.append((x + radius * turn * (np.sin(heading + turn * s) - np.sin(heading)),
                               y + radius * turn * (np.cos(heading) - np.cos(heading + turn * s))))
        x, y = points[-1]
        heading += turn * part
    return points


def poses_along(path, radius, spacing=0.02):
    """Return points (n, 2) along (start, turns, parts), one after the other."""
    points = [path[0][0][:2]]
    for start, turns, parts in path:
        points += points_along(start, turns, parts, radius, spacing)
    return np.array(points)


def rrt_dubins(problem, shapes, seed, limit):
    """Return (time, cost, path) of RRT-Dubins with its metric `local`, path None if the time is over.

    Every node times every word, the ten shortest tried in turn, no limit of length.
    """
    rng, radius, goal = random.Random(seed), problem.turning_radius, problem.goal
    x_min, y_min, x_max, y_max = shapes.bounds
    costs, parents = {problem.start: 0.0}, {problem.start: None}
    begun = time.thread_time()
    while time.thread_time() - begun < limit:
        sample = goal
        if rng.random() >= 0.1:
            while True:
                sample = (rng.uniform(x_min, x_max), rng.uniform(y_min, y_max), rng.uniform(0, math.tau))
                if shapes.is_free(sample[0], sample[1]):
                    break
        if sample in costs:
            continue
        options = [(word, node) for node in costs for word in words(node, sample, radius)]
        options.sort(key=lambda option: option[0][0])
        for (length, turns, parts), node in options[:10]:
            if all(shapes.is_free(x, y) for x, y in points_along(node, turns, parts, radius, 1.0)):
                costs[sample], parents[sample] = costs[node] + length, (node, turns, parts)
                break
        else:
            continue
        if in_zone(sample, problem):
            return time.thread_time() - begun, costs[sample], trace(parents, sample)
    return limit, math.inf, None


def rrt_python_robotics(problem, shapes, seed, limit):
    """Return (time, cost, path) of PythonRobotics' RRT over Dubins paths."""
    rng, radius, goal = random.Random(seed), problem.turning_radius, problem.goal
    x_min, y_min, x_max, y_max = shapes.bounds
    nodes, costs, parents = [problem.start], {problem.start: 0.0}, {problem.start: None}
    begun = time.thread_time()
    while time.thread_time() - begun < limit:
        sample = goal
        if rng.random() >= 0.1:
            sample = (rng.uniform(x_min, x_max), rng.uniform(y_min, y_max), rng.uniform(-math.pi, math.pi))
        distances = [(node[0] - sample[0])**2 + (node[1] - sample[1])**2 for node in nodes]
        node = nodes[distances.index(min(distances))]
        if sample in costs:
            continue
        length, turns, parts = min(words(node, sample, radius))
        if all(shapes.is_free(x, y) for x, y in points_along(node, turns, parts, radius, 0.1 * radius)):
            nodes.append(sample)
            costs[sample], parents[sample] = costs[node] + length, (node, turns, parts)
            if in_zone(sample, problem):
                return time.thread_time() - begun, costs[sample], trace(parents, sample)
    return limit, math.inf, None


def in_zone(pose, problem):
    """Return whether a pose lies in the problem's goal zone."""
    dx, dy, turn = (pose[k] - problem.goal[k] for k in range(3))
    tolerance = problem.goal_tolerance
    return (abs(dx) <= tolerance[0] and abs(dy) <= tolerance[1]
            and abs((turn + math.pi) % math.tau - math.pi) <= tolerance[2])


def trace(parents, node):
    """Return the ways (start, turns, parts) from the root to a node."""
    path = []
    while parents[node] is not None:
        path.append(parents[node])
        node = parents[node][0]
    return path[::-1]
