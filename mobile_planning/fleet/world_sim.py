"""WorldSim: a whole mission in process, in logical time, the same to the byte for one seed."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.channel import Channel
from mobile_planning.fleet.episode import Episode
from mobile_planning.fleet.errands import Errands
from mobile_planning.fleet.faults import Faults
from mobile_planning.fleet.invariant import Breach
from mobile_planning.fleet.makespan import lower_bound
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body, Report, verify
from mobile_planning.fleet.waiting import waiting_at
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

    Attributes
    ----------
    robots : dict of int to Robot
        As they were before the mission; a robot that restarts is another one.
    environment : Environment
    episode : Episode or None
        What happened; None before the mission is run.

    Raises
    ------
    InvalidInput
        Two robots have one id, or have starts, or goals, closer than their radii and margins allow, or one has a
        neighbour that is none of them.
    """

    def __init__(self, name_id: str, robots: Sequence[Robot], obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, grid: OccupancyGrid | None = None):
        self.name = str(name_id)
        self.robots = {robot.eyed: robot for robot in robots}
        self.environment = Environment(phy_boundary, obstacles, grid)
        self.episode: Episode | None = None
        if len(self.robots) != len(robots) or not robots:
            raise InvalidInput(f'robot ids must differ and there must be one robot: {[r.eyed for r in robots]}')
        if len({robot.method for robot in robots}) > 1:
            raise InvalidInput('all robots of a mission plan by one method, not '
                               + ', '.join(f'{robot.eyed} by {robot.method}' for robot in robots))
        strangers = [(robot.eyed, other) for robot in robots for other in robot.neigh if other not in self.robots]
        if strangers:
            raise InvalidInput('neighbours are robots of the mission, not ' + ', '.join(
                f'{other}, in whose range robot {eyed} is to stay' for eyed, other in strangers))
        require_apart([replace(body_of(robot), radius=robot.limits.radius) for robot in robots])

    @property
    def solutions(self) -> dict[int, Solution]:
        """What each robot has driven, by id, under all its processes."""
        if self.episode is not None:
            return {eyed: vehicle.solution for eyed, vehicle in self.episode.vehicles.items()}
        return {eyed: robot.sol for eyed, robot in self.robots.items()}

    @property
    def bodies(self) -> list[Body]:
        """What each robot is held to: its start, and all goals that it was given or was to be given."""
        bodies = [body_of(robot) for robot in self.robots.values()]
        if self.episode is None:
            return bodies
        goals = self.episode.goals
        return [replace(body, goal=goals[body.eyed][-1], via=goals[body.eyed][:-1]) for body in bodies]

    @property
    def breaches(self) -> list[Breach]:
        """What broke in the mission, when and between whom."""
        return [] if self.episode is None else self.episode.breaches

    def run(self, seed: int = 0, loss: float = 0.0, delay: float = 0.0, timeout: float = 60.0, *,
            start_time: float = 0.0, faults: Faults = Faults(), errands: Errands | None = None,
            check: bool = True) -> Report:
        """Drive the mission and return the report on it.

        Parameters
        ----------
        seed : int
            Of all that is random: phases, clocks, times to plan, and the channel.
        loss : float
            Share of the messages lost.
        delay : float [s]
            Greatest extra time of a message on its way.
        timeout : float [s]
            Simulated time after which the mission ends as it stands.
        start_time : float [s]
            Of the mission, on the fleet's clock.
        faults : Faults
            What else goes wrong.
        errands : Errands or None
            Gives each robot that has arrived its next goal; all that were given are in ``bodies``.
        check : bool
            The invariant is checked after every event; what breaks is in ``breaches`` and in the report.

        Raises
        ------
        InvalidInput
            A number is out of its range, or a fault befalls a robot that is not there.
        """
        if seed < 0 or not 0 < timeout < np.inf or not np.isfinite(start_time):
            raise InvalidInput(f'seed {seed}, timeout {timeout} s or start time {start_time} s is out of range')
        if self.episode is not None:
            raise InvalidInput('a robot drives one mission: make a new simulation for another run')
        channel = Channel(loss, delay, duplicates=faults.duplicates, interruptions=faults.interruptions)
        self.episode = Episode(list(self.robots.values()), seed, channel, faults, start_time, errands=errands,
                               is_watched=check)
        self.episode.run(timeout)
        return self.verify(start_time)

    def verify(self, start_time: float) -> Report:
        """Return the report on the solutions as they stand."""
        bodies = self.bodies
        report = verify(self.solutions, bodies, self.environment, start_time, self.name)
        if self.episode is None:
            return report
        episode, breaches = self.episode, [*self.episode.refused, *map(str, self.breaches)]
        return replace(report, valid=report.valid and not breaches, violations=report.violations + breaches,
                       lower_bound=lower_bound(bodies, self.environment), dead=len(episode.dead),
                       messages=episode.messages, message_bytes=episode.message_bytes, joint_plans=episode.joint_plans,
                       waiting=waiting_at(list(episode.vehicles.values()), report.at_goal, self.environment,
                                          episode.ended))


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
