"""ProvedSections: sections in the world as one robot sees it, each proved by the independent verifier."""
from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.horizon_blocks import Block, Path
from mobile_planning.fleet.horizon_options import HorizonOptions
from mobile_planning.fleet.horizon_section import Found, Kind, Start
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.receding_horizon import SectionPlanner, seen_region
from mobile_planning.fleet.report import Body
from mobile_planning.fleet.section import Limits
from mobile_planning.fleet.solution import Solution
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.convex_pieces import ConvexPieces
from mobile_planning.world.environment import Environment

#: A robot has arrived within this of its goal [m].
GOAL_TOLERANCE = 0.02


class ProvedSections:
    """Finds the sections of one robot.

    Parameters
    ----------
    model : UnicycleKineModel
    environment : Environment
        All of it; what of its obstacles is farther away than ``detec_rho`` is not looked at.
    limits : Limits
    options : HorizonOptions
    """

    def __init__(self, model: UnicycleKineModel, environment: Environment, limits: Limits, options: HorizonOptions):
        self._model, self._environment, self._limits = model, environment, limits
        self._planner = SectionPlanner(options, limits, model.z_final)
        self._seen: tuple[tuple, Environment, ConvexPieces] | None = None

    @property
    def options(self) -> HorizonOptions:
        """How sections are planned."""
        return self._planner.options

    @options.setter
    def options(self, options: HorizonOptions) -> None:
        self._planner.options = options

    def find(self, kind: Kind, first: int, start: Start, place: NDArray, blocks: Sequence[Block], duration: float,
             is_clear: Callable[[Plan], bool]) -> tuple[Found, Plan | None]:
        """Return what became of the programs of a section, and the plan that is proved, or None.

        Parameters
        ----------
        kind : Kind
        first : int
            Knot from which it begins.
        start : Start
        place : (2,) ndarray [m]
            Where the robot is now, and looks around.
        blocks : sequence of Block
            Constraints beside those of the robot alone.
        duration : float [s]
        is_clear : callable
            Whether a plan is clear of those of others.
        """
        options = self.options
        if start.is_at_rest and self.is_at_goal(start.points[-1]):
            still = Plan(first, options.step, np.repeat(start.points[-1:], 4, axis=0), start.heading)
            return Found(still.points), self._turned(still)
        seen, pieces = self._detected(place)
        if len(seen.obstacles) < len(self._environment.obstacles):
            blocks = [*blocks, seen_region(place, options.detec_rho, self._limits.radius)]
        proved: list[Plan] = []

        def prove(points: NDArray) -> bool:
            plan = Plan(first, options.step, points, start.heading)
            plan = self._turned(plan) if kind is Kind.LAST else plan
            if self._is_proved(plan, seen) and is_clear(plan):
                proved.append(plan)
            return bool(proved)

        found = self._planner.plan(kind, start, pieces, blocks, duration=duration, prove=prove)
        return found, proved[0] if proved else None

    def is_free(self, plan: Plan) -> bool:
        """Return whether ``plan`` touches nothing of the whole world, seen or not, and keeps to the limits."""
        return self._is_proved(plan, self._environment)

    def is_at_goal(self, place: NDArray) -> bool:
        """Return whether ``place`` (2,) [m] is the goal."""
        return bool(np.linalg.norm(place - self._model.z_final) <= GOAL_TOLERANCE)

    def _is_proved(self, plan, seen):
        """Return whether the independent verifier finds nothing wrong with ``plan``."""
        from mobile_planning.fleet.verification import verify

        limits, began = self._limits, plan.first_knot * plan.step
        body = Body(0, limits.radius, plan.state(began)[:3], self._model.q_final, limits.v_max, limits.omega_max,
                    limits.a_max, is_under_way=True)
        return not verify({0: Solution(0, (plan,))}, [body], seen, began).violations

    def _turned(self, plan):
        """Return the last plan with a turn to the final heading at its end, which takes no room."""
        arrival, final = float(plan.state(plan.end_knot * plan.step)[2]), float(self._model.q_final[2])
        spans = int(np.ceil(abs(wrap_angle(final - arrival)) / (self._limits.omega_max * plan.step) + 1e-6))
        points = np.concatenate([plan.points, np.repeat(plan.points[-1:], spans, axis=0)])
        return Plan(plan.first_knot, plan.step, points, plan.heading, final)

    def _detected(self, place):
        """Return the world as far as it is seen from ``place``, and its convex pieces."""
        world = self._environment
        obstacles = tuple(obstacle for obstacle in world.obstacles
                          if obstacle.detected_dist(place) <= self.options.detec_rho)
        if self._seen is None or self._seen[0] != obstacles:
            seen = Environment(world.boundary, obstacles, world.grid)
            self._seen = obstacles, seen, ConvexPieces(seen)
        return self._seen[1:]


def path_of(plan: Plan, since: float) -> Path:
    """Return where ``plan`` is, as a function of the time [s] from ``since`` [s] on."""
    known: dict[str, NDArray] = {}

    def path(times: NDArray) -> tuple[NDArray, NDArray]:
        # A section of fixed duration asks for the same times again and again.
        if 'times' not in known or not np.array_equal(known['times'], times):
            states = plan.states(since + times)
            along = np.column_stack([np.cos(states[:, 2]), np.sin(states[:, 2])])
            known.update(times=times.copy(), places=states[:, :2], velocities=states[:, 3:4] * along)
        return known['places'], known['velocities']
    return path
