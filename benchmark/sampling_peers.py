"""Other sampling planners on our problems: the OMPL wheel, and two published Python planners restated.

All of them ask whether points are free of a raster of 0.1 m, which is their fastest way: a look-up.
"""
import math
import random
import time

import numpy as np

RASTER = 0.1


class Raster:
    """Which squares of 0.1 m have their middle in an obstacle."""

    def __init__(self, problem):
        x_min, y_min, x_max, y_max = self.bounds = problem.environment.bounds
        self.columns, self.rows = round((x_max - x_min) / RASTER), round((y_max - y_min) / RASTER)
        x, y = x_min + (np.arange(self.columns) + 0.5) * RASTER, y_min + (np.arange(self.rows) + 0.5) * RASTER
        free = problem.environment.free_poses(np.stack(np.meshgrid(x, y), axis=-1))
        self.cells = free.ravel().tolist()

    def is_free(self, x, y):
        """Return whether a point is free."""
        column, row = int((x - self.bounds[0]) / RASTER), int((y - self.bounds[1]) / RASTER)
        return 0 <= column < self.columns and 0 <= row < self.rows and self.cells[row * self.columns + column]


def words(start, goal, radius):
    """Return (length, turns, angles) of each Dubins word that leads from start to goal, in plain Python."""
    dx, dy = (goal[0] - start[0]) / radius, (goal[1] - start[1]) / radius
    distance, direction = math.hypot(dx, dy), math.atan2(dy, dx)
    a, b = (start[2] - direction) % math.tau, (goal[2] - direction) % math.tau
    sa, ca, sb, cb, cab = math.sin(a), math.cos(a), math.sin(b), math.cos(b), math.cos(a - b)
    found = []

    def add(turns, t, p, q):
        t, q = t % math.tau, q % math.tau
        found.append(((t + p + q) * radius, turns, (t, p, q)))
    squared = 2 + distance**2 - 2 * cab + 2 * distance * (sa - sb)
    if squared >= 0:
        angle = math.atan2(cb - ca, distance + sa - sb)
        add((1, 0, 1), angle - a, math.sqrt(squared), b - angle)
    squared = 2 + distance**2 - 2 * cab + 2 * distance * (sb - sa)
    if squared >= 0:
        angle = math.atan2(ca - cb, distance - sa + sb)
        add((-1, 0, -1), a - angle, math.sqrt(squared), angle - b)
    squared = distance**2 - 2 + 2 * cab + 2 * distance * (sa + sb)
    if squared >= 0:
        p = math.sqrt(squared)
        angle = math.atan2(-ca - cb, distance + sa + sb) - math.atan2(-2, p)
        add((1, 0, -1), angle - a, p, angle - b)
    squared = distance**2 - 2 + 2 * cab - 2 * distance * (sa + sb)
    if squared >= 0:
        p = math.sqrt(squared)
        angle = math.atan2(ca + cb, distance - sa - sb) - math.atan2(2, p)
        add((-1, 0, 1), a - angle, p, b - angle)
    value = (6 - distance**2 + 2 * cab + 2 * distance * (sa - sb)) / 8
    if abs(value) <= 1:
        p = math.tau - math.acos(value)
        t = a - math.atan2(ca - cb, distance - sa + sb) + p / 2
        add((-1, 1, -1), t, p, a - b - t + p)
    value = (6 - distance**2 + 2 * cab + 2 * distance * (sb - sa)) / 8
    if abs(value) <= 1:
        p = math.tau - math.acos(value)
        t = -a + math.atan2(-ca + cb, distance + sa - sb) + p / 2
        add((1, -1, 1), t, p, b - a - t + p)
    return found


def points_along(start, turns, angles, radius, spacing):
    """Return points (x, y) so far apart along a word, the end among them."""
    x, y, heading = start
    points = []
    for turn, angle in zip(turns, angles):
        count = max(1, math.ceil(angle * radius / spacing))
        for k in range(1, count + 1):
            s = angle * k / count
            if turn == 0:
                points.append((x + radius * s * math.cos(heading), y + radius * s * math.sin(heading)))
            else:
                points.append((x + radius * turn * (math.sin(heading + turn * s) - math.sin(heading)),
                               y + radius * turn * (math.cos(heading) - math.cos(heading + turn * s))))
        x, y = points[-1]
        heading += turn * angle
    return points


def poses_along(path, radius, spacing=0.02):
    """Return poses (n, 2) along (start, turns, angles), one after the other."""
    points = [path[0][0][:2]]
    for start, turns, angles in path:
        points += points_along(start, turns, angles, radius, spacing)
    return np.array(points)


def rrt_dubins(problem, raster, seed, limit):
    """Return (time, cost, path) of the published RRT-Dubins with its metric `local`, path None if the time is over.

    Every node times every word, the ten shortest tried in turn, checked at points 1 m apart, no limit of length.
    """
    rng, radius, goal = random.Random(seed), problem.turning_radius, problem.goal
    x_min, y_min, x_max, y_max = raster.bounds
    costs, parents = {problem.start: 0.0}, {problem.start: None}
    begun = time.thread_time()
    while time.thread_time() - begun < limit:
        sample = goal
        if rng.random() >= 0.1:
            while True:
                sample = (rng.uniform(x_min, x_max), rng.uniform(y_min, y_max), rng.uniform(0, math.tau))
                if raster.is_free(sample[0], sample[1]):
                    break
        options = sorted((word[0], node, word) for node in costs for word in words(node, sample, radius))[:10]
        for length, node, (_, turns, angles) in options:
            if node != sample and all(raster.is_free(x, y) for x, y in points_along(node, turns, angles, radius, 1.0)):
                costs[sample], parents[sample] = costs[node] + length, (node, turns, angles)
                break
        else:
            continue
        if in_zone(sample, problem):
            return time.thread_time() - begun, costs[sample], trace(parents, sample)
    return limit, math.inf, None


def rrt_python_robotics(problem, raster, seed, limit):
    """Return (time, cost, path) of PythonRobotics' RRT over Dubins paths.

    The nearest node by the line, its shortest word, checked at points a tenth of a radius apart.
    """
    rng, radius, goal = random.Random(seed), problem.turning_radius, problem.goal
    x_min, y_min, x_max, y_max = raster.bounds
    nodes, costs, parents = [problem.start], {problem.start: 0.0}, {problem.start: None}
    begun = time.thread_time()
    while time.thread_time() - begun < limit:
        sample = goal
        if rng.random() >= 0.1:
            sample = (rng.uniform(x_min, x_max), rng.uniform(y_min, y_max), rng.uniform(-math.pi, math.pi))
        distances = [(node[0] - sample[0])**2 + (node[1] - sample[1])**2 for node in nodes]
        node = nodes[distances.index(min(distances))]
        if node == sample:
            continue
        length, turns, angles = min(words(node, sample, radius))
        if all(raster.is_free(x, y) for x, y in points_along(node, turns, angles, radius, 0.1 * radius)):
            nodes.append(sample)
            costs[sample], parents[sample] = costs[node] + length, (node, turns, angles)
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
    """Return the ways (start, turns, angles) from the root to a node."""
    path = []
    while parents[node] is not None:
        path.append(parents[node])
        node = parents[node][0]
    return path[::-1]


class Ompl:
    """The OMPL wheel on one problem, over Dubins paths or in the plane."""

    def __init__(self, problem, raster):
        from ompl import base
        from ompl import util

        util.setLogLevel(util.LogLevel.LOG_ERROR)
        self._problem = problem
        car = problem.kind == 'dubins'
        self.space = base.DubinsStateSpace(problem.turning_radius) if car else base.RealVectorStateSpace(2)
        bounds = base.RealVectorBounds(2)
        x_min, y_min, x_max, y_max = problem.environment.bounds
        for axis, (low, high) in enumerate(((x_min, x_max), (y_min, y_max))):
            bounds.setLow(axis, low)
            bounds.setHigh(axis, high)
        self.space.setBounds(bounds)
        self._is_car, self._raster = car, raster

    def _state(self, values):
        state = self.space.allocState()
        if self._is_car:
            state.setX(values[0])
            state.setY(values[1])
            state.setYaw(math.remainder(values[2], math.tau))
        else:
            state[0], state[1] = values[:2]
        return state

    def solve(self, kind, limit):
        """Return (time, cost, points) of the planner class ``kind`` after at most ``limit`` seconds."""
        from ompl import geometric

        raster = self._raster
        setup = geometric.SimpleSetup(self.space)
        if self._is_car:
            setup.setStateValidityChecker(lambda state: raster.is_free(state.getX(), state.getY()))
        else:
            setup.setStateValidityChecker(lambda state: raster.is_free(state[0], state[1]))
        # Checked every 0.1 m.
        setup.getSpaceInformation().setStateValidityCheckingResolution(0.1 / self.space.getMaximumExtent())
        setup.setStartAndGoalStates(self._state(self._problem.start), self._state(self._problem.goal), 0.3)
        planner = getattr(geometric, kind)(setup.getSpaceInformation())
        planner.setGoalBias(0.1)
        setup.setPlanner(planner)
        setup.setup()
        begun = time.thread_time()
        setup.solve(limit)
        spent = time.thread_time() - begun
        if not setup.haveExactSolutionPath():
            return spent, math.inf, None
        path = setup.getSolutionPath()
        cost = path.length()
        path.interpolate(max(2, int(cost / 0.02)))
        states = path.getStates()
        points = [(s.getX(), s.getY()) if self._is_car else (s[0], s[1]) for s in states]
        return spent, cost, np.array(points)
