"""Every grid planner behind one face: from cell to cell on a `PlanningMap`, by its id, its plans kept."""
from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mobile_planning.geometry import wrap_angle
from mobile_planning.grid.astar import astar
from mobile_planning.grid.bug2 import Bug2
from mobile_planning.grid.distance_transform import DistanceTransformPlanner
from mobile_planning.grid.dstar import DstarPlanner
from mobile_planning.grid.lattice import LatticePlanner
from mobile_planning.planning_map import PlanningMap
from mobile_planning.stop_flag import StopFlag

_PLANS_KEPT = 4
# How often a query that waits for a plan looks at its deadline [s].
_PERIOD = 0.005
_HEADINGS = 16
# What the lattice pays for turning [cells/rad]. Without it the shortest way that lies between two headings is a zigzag
# of arcs; with it one bend, on the depot map at most 0.5 % longer for all of 60 paths (radii of 1 to 80 cells).
_TURN_COST = 1.0


class Route(NamedTuple):
    """A path on the grid.

    Attributes
    ----------
    points : (N, 2) or (N, 3) ndarray
        Cells, centres on the integers; with a heading [rad] where the planner has one.
    cost : float [cells]
    facts : dict of str to str
        How it came about.
    """

    points: NDArray
    cost: float
    facts: dict[str, str]


@dataclass(frozen=True)
class Rules:
    """How robots move.

    Attributes
    ----------
    corner_cutting : bool
    turning_radius : float [cells]
    reverse_cost : float, optional
        How many times its length a way costs the lattice backwards; None: forwards only.
    """

    corner_cutting: bool
    turning_radius: float
    reverse_cost: float | None = None


class Plan(ABC):
    """What a planner keeps between queries; one thread at a time uses it.

    Parameters
    ----------
    rules : Rules
    goal : (2,) ndarray of int
        Cell.
    """

    # Whether what is kept serves one goal, or all of them.
    is_for_one_goal = True

    def __init__(self, rules: Rules, goal: NDArray[np.int64]):
        self.lock = threading.Lock()
        self._rules, self._goal = rules, goal
        self._planner = self._occupied = None

    @abstractmethod
    def route(self, terrain: PlanningMap, start: NDArray, goal: NDArray, stop: NDArray[np.uint8],
              done: NDArray[np.int64]) -> Route:
        """Return the route between two configurations (3,) in cells; raise NoPath or Cancelled.

        Work that can be counted has finished ``done[0]`` of ``done[1]`` parts.
        """

    def _kept(self, terrain, make):
        """Return the planner, made anew if another cell is occupied than before, and where it comes from."""
        if self._planner is not None and self._occupied is terrain.occupied:
            return self._planner, 'reused'
        # Kept only once it is complete.
        self._planner = make()
        self._occupied = terrain.occupied
        return self._planner, 'computed'


class DistanceTransformPlan(Plan):
    """The field of distances to the goal."""

    def field(self, terrain: PlanningMap, stop: NDArray[np.uint8], done: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the distance to the goal of every cell [cells]: NaN if occupied, inf if unreachable."""
        return self._prepared(terrain, stop, done)[0].distancemap

    def route(self, terrain, start, goal, stop, done):
        """Go down the field."""
        planner, origin = self._prepared(terrain, stop, done)
        path = planner.query(start[:2], stop=stop)
        return Route(path, _length(path), {'plan': origin})

    def _prepared(self, terrain, stop, done):
        def make():
            planner = DistanceTransformPlanner(terrain.occupied, corner_cutting=self._rules.corner_cutting)
            planner.plan(self._goal, progress=done, stop=stop)
            return planner
        return self._kept(terrain, make)


class DstarPlan(Plan):
    """A field of costs, repaired when costs change."""

    _version = None

    def field(self, terrain: PlanningMap, stop: NDArray[np.uint8], done: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the cost from every cell to the goal [cells]: NaN if occupied, inf if unreachable."""
        self._prepare(terrain, stop, done)
        return self._planner.cost_to_go(stop)

    def route(self, terrain, start, goal, stop, done):
        """Repair the field, and go down it."""
        before = 0 if self._planner is None else self._planner.nexpand
        origin = self._prepare(terrain, stop, done)
        path, status = self._planner.query(start[:2], stop=stop)
        expansions = self._planner.nexpand - before
        if origin == 'reused' and expansions:
            origin = 'computed' if status.full_replan else 'repaired'
        return Route(path, float(status.cost), {
            'plan': origin, 'expansions': str(expansions), 'full_replan': str(bool(status.full_replan)).lower()})

    def _prepare(self, terrain, stop, done):
        """Bring the plan to the costs of the map, and return where it comes from."""
        if self._planner is None:
            planner = DstarPlanner(terrain.occupied if terrain.weights is None else terrain.cost_map(stop),
                                   corner_cutting=self._rules.corner_cutting, stop=stop)
            planner.plan(self._goal, progress=done, stop=stop)
            self._planner, self._version = planner, terrain.version
            return 'computed'
        if self._version != terrain.version:
            rows = terrain.changes_since(self._version)
            self._planner.update(terrain.changes_from(self._planner.costmap, stop) if rows is None else rows)
            self._version = terrain.version
        return 'reused'


class AstarPlan(Plan):
    """Nothing is kept: every query is a search."""

    is_for_one_goal = False

    def route(self, terrain, start, goal, stop, done):
        """Search, at the costs of the cells if they differ."""
        path, cost = astar(terrain.occupied, start[:2], goal[:2], corner_cutting=self._rules.corner_cutting,
                           costs=terrain.weights, stop=stop)
        return Route(path, float(cost), {})


class Bug2Plan(Plan):
    """Nothing is kept: the robot sets out without knowing anything."""

    is_for_one_goal = False

    def route(self, terrain, start, goal, stop, done):
        """Walk."""
        robot = Bug2(terrain.occupied, corner_cutting=self._rules.corner_cutting)
        path = robot.run(start[:2], goal[:2], stop=stop)
        return Route(path, _length(path), {'hits': str(len(robot.hits))})


class LatticePlan(Plan):
    """The lattice of a map, in which every query searches."""

    is_for_one_goal = False

    def route(self, terrain, start, goal, stop, done):
        """Search from the lattice's heading nearest to the start's to the one nearest to the goal's."""
        planner, _ = self._kept(terrain, lambda: LatticePlanner(
            occgrid=terrain.occupied, headings=_HEADINGS, radius=self._rules.turning_radius,
            corner_cutting=self._rules.corner_cutting, reverse_cost=self._rules.reverse_cost, turn_cost=_TURN_COST))
        ends = [planner.nearest(end) for end in (start, goal)]
        path, status = planner.query(*ends, stop=stop)
        facts = {'segments': str(len(status.segments)), 'headings': str(_HEADINGS)}
        for name, asked, end in zip(('start', 'goal'), (start, goal), ends):
            facts[f'{name}_heading_off'] = f'{abs(wrap_angle(end[2] - asked[2])):.3f} rad'
        return Route(planner.curve(path)[0], sum(edge.length for edge in status.edges), facts)


PLANS = {'distance_transform': DistanceTransformPlan, 'dstar': DstarPlan, 'astar': AstarPlan, 'lattice': LatticePlan,
         'bug2': Bug2Plan}


class KeptPlans:
    """The plans made for maps of one size at one place, the least used forgotten.

    Parameters
    ----------
    rules : Rules
    """

    def __init__(self, rules: Rules):
        self.rules = rules
        self._plans = OrderedDict()
        self._lock = threading.Lock()

    @contextmanager
    def plan(self, name: str, goal: NDArray[np.int64], flag: StopFlag) -> Iterator[Plan]:
        """Give the plan of a planner for a goal to this thread alone.

        Parameters
        ----------
        name : str
            Id of the planner.
        goal : (2,) ndarray of int
            Cell.
        flag : StopFlag
            Ends the wait for another thread too.
        """
        kind = PLANS[name]
        key = (name, *goal.tolist()) if kind.is_for_one_goal else (name,)
        with self._lock:
            if key not in self._plans:
                self._plans[key] = kind(self.rules, goal)
            plan = self._plans[key]
            self._plans.move_to_end(key)
            while len(self._plans) > _PLANS_KEPT:
                self._plans.popitem(last=False)
        while not plan.lock.acquire(timeout=_PERIOD):
            flag.check()
        try:
            yield plan
        finally:
            plan.lock.release()


def _length(path):
    """Return the length of a path of cells [cells]."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())
