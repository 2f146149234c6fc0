"""WorldSim: a whole mission in process, in logical time, the same to the byte for one seed."""
from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.channel import Channel
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body, Report, verify
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid


class WorldSim:
    """The robots, the world they share, and the judge of what they drive.

    Parameters
    ----------
    name_id : str
        Name of the mission.
    robots : sequence of Robot
        Each with its own id; a robot drives one mission.
    obstacles : sequence of Obstacle
    phy_boundary : Boundary or None
    grid : OccupancyGrid or None

    Raises
    ------
    InvalidInput
        Two robots have one id, or have starts, or goals, closer than their radii and margins allow.
    """

    def __init__(self, name_id: str, robots: Sequence[Robot], obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, grid: OccupancyGrid | None = None):
        self.name = str(name_id)
        self.robots = {robot.eyed: robot for robot in robots}
        self.environment = Environment(phy_boundary, obstacles, grid)
        if len(self.robots) != len(robots) or not robots:
            raise InvalidInput(f'robot ids must differ and there must be one robot: {[r.eyed for r in robots]}')
        require_apart([replace(body_of(robot), radius=robot.limits.radius) for robot in robots])

    @property
    def solutions(self) -> dict[int, Solution]:
        """What each robot has driven, by id."""
        return {eyed: robot.sol for eyed, robot in self.robots.items()}

    def run(self, seed: int = 0, loss: float = 0.0, delay: float = 0.0, timeout: float = 60.0, *,
            start_time: float = 0.0) -> Report:
        """Drive the mission and return the report on it.

        Parameters
        ----------
        seed : int
            Of the robots' phases and of the channel.
        loss : float
            Share of the messages lost.
        delay : float [s]
            Greatest extra time of a message on its way.
        timeout : float [s]
            Simulated time after which the mission ends as it stands.
        start_time : float [s]
            Of the mission, on the fleet's clock; no robot is switched on later.

        Raises
        ------
        InvalidInput
            A number is out of its range.
        """
        if seed < 0 or not 0 < timeout < np.inf or not np.isfinite(start_time):
            raise InvalidInput(f'seed {seed}, timeout {timeout} s or start time {start_time} s is out of range')
        rng, channel = np.random.default_rng(seed), Channel(loss, delay)
        ticket = count()
        events = [(start_time + float(phase) * robot.Tc, next(ticket), robot, None)
                  for robot, phase in zip(self.robots.values(), rng.random(len(self.robots)))]
        heapq.heapify(events)
        for robot in self.robots.values():
            robot.start(list(self.robots), start_time)
        while events and events[0][0] <= start_time + timeout:
            now, _, robot, message = heapq.heappop(events)
            if message is not None:
                robot.receive(message, now)
                continue
            for sent in robot.step(now):
                for peer in self.robots.values():
                    travel = channel.travel_time(rng) if peer is not robot else None
                    if travel is not None:
                        heapq.heappush(events, (now + travel, next(ticket), peer, sent))
            heapq.heappush(events, (now + robot.Tc, next(ticket), robot, None))
            if all(other.is_done for other in self.robots.values()):
                break
        return self.verify(start_time)

    def verify(self, start_time: float) -> Report:
        """Return the report on the solutions as they stand."""
        return verify(self.solutions, [body_of(robot) for robot in self.robots.values()],
                      self.environment, start_time, self.name)


def body_of(robot: Robot) -> Body:
    """Return what ``robot`` is held to when its solution is judged."""
    model = robot.k_mod
    return Body(robot.eyed, robot.rho, model.q_init, model.q_final, *model.u_max, model.acc_max[0])


def require_apart(bodies: Sequence[Body]) -> None:
    """Raise InvalidInput where two bodies overlap at their starts, or at their goals."""
    for index, a in enumerate(bodies):
        for b in bodies[:index]:
            for what in ('start', 'goal'):
                distance = np.linalg.norm(getattr(a, what)[:2] - getattr(b, what)[:2])
                if distance <= a.radius + b.radius:
                    raise InvalidInput(f'robots {b.eyed} and {a.eyed} overlap at their {what}s: {distance:.3f} m '
                                       f'between centres, their radii need {a.radius + b.radius:.3f} m')
