"""The OMPL wheel on our problems.

It asks whether points are free of a raster of 0.1 m, which is its fastest way: a look-up.
"""
import math
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
        if hasattr(planner, 'setGoalBias'):
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
