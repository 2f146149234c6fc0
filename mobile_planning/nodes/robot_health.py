"""RobotHealth: how a robot is, for its status and its diagnostics."""
from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from math import isnan
from time import monotonic

import numpy as np
from mobile_planning_msgs.msg import RobotStatus

from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.peers import PeerTable
from mobile_planning.nodes import wire
from mobile_planning.nodes.body import Body
from mobile_planning.nodes.convert import header, pose_message
from mobile_planning.nodes.diagnostics import Level
from mobile_planning.nodes.robot_options import RobotOptions

#: A section that takes longer than this [s] has hung.
_HUNG = 5.0
#: A section is missed by the end of its cycle, and by this share of one earlier.
_EARLY = 0.25


class RobotHealth:
    """Watches one robot: who is heard, whether it plans in time, and whether its errors are within their margins.

    Parameters
    ----------
    agent : Agent
    body : Body
    peers : PeerTable
    options : RobotOptions
    """

    def __init__(self, agent: Agent, body: Body, peers: PeerTable, options: RobotOptions):
        self._agent, self._body, self._peers, self._options = agent, body, peers, options
        self._silent: frozenset[int] = frozenset()
        self._late, self._pending, self._began, self._longest = 0, 0, np.inf, 0.0
        self._lag = 0.0

    def timed(self, work: Callable) -> Callable:
        """Return ``work``, which is watched while it lasts."""
        @wraps(work)
        def watched(*args):
            self._began = monotonic()
            try:
                return work(*args)
            finally:
                self._longest, self._began = max(self._longest, monotonic() - self._began), np.inf
        return watched

    def expect(self, lag: float) -> None:
        """Take in how far [m] the body is sure to come off its plans where it turns in place."""
        self._lag = lag

    def look(self, asked_for: float, logger) -> bool:
        """Note how many cycles are missed, and who fell silent or is heard again; return whether anybody did.

        Parameters
        ----------
        asked_for : float [s]
            For how long the section has been asked for that is still being planned; negative for none.
        logger
            That is told who.
        """
        # A timer is not punctual. Who plans each knot and misses one has not missed a cycle.
        missed = int(asked_for / self._options.Tc + _EARLY) if asked_for > 0.0 else 0
        self._late, self._pending = self._late + max(0, missed - self._pending), missed
        silent = frozenset(self._heard_not())
        if self._agent.robot is None or silent == self._silent:
            return False
        for verb, who in (('silent', silent - self._silent), ('heard', self._silent - silent)):
            if who:
                logger.info(f'{verb}: robots {sorted(who)}')
        self._silent = silent
        return True

    def heed(self, now: float) -> None:
        """Hold the robot while its pose is lost; may wait for the agent."""
        age, limit = self._body.status.pose_age, self._options.pose_timeout
        if self._agent.robot is not None and age > limit:
            self._agent.hold('pose', f'no pose for more than {limit:g} s', now)
        else:
            self._agent.release('pose', now)

    def _heard_not(self):
        own = self._options.ids
        return self._peers.silent([other for other in self._agent.roster if other not in own], monotonic())

    def clock_error(self) -> float:
        """Return by how much [s] the clock differs from that of a peer at least."""
        return max((self._peers.clock_error(other) for other in self._agent.roster), default=0.0)

    def status(self, now: float, frame: str) -> RobotStatus:
        """Return the message that says how the robot is."""
        robot, body = self._agent.robot, self._body.status
        message = RobotStatus(
            header=header(frame, wire.stamp(now)), trouble=self._agent.trouble, tracking=bool(body.is_tracking),
            robot_id=int(self._agent.robot_id),
            tracking_error=float(body.tracking_error), localisation_error=float(body.localisation_error),
            clock_error=float(self.clock_error()), pose_age=float(body.pose_age), margin=float(self._options.margin),
            silent=sorted(self._silent), goals_left=self._agent.journey.itinerary.left,
            goals_reached=self._agent.journey.itinerary.reached)
        if robot is not None:
            message.mode, message.goal = int(robot.mode), pose_message(robot.goal)
            message.goals_left += not self._agent.is_finished
        return message

    def diagnosis(self, now: float) -> tuple[Level, str, dict[str, object]]:
        """Return level, message and facts for the diagnostics."""
        robot, body = self._agent.robot, self._body.status
        longest, self._longest = self._longest, 0.0
        if robot is None:
            return Level.WARN, self._agent.trouble, {}
        facts = {'peers heard': len(robot.protocol.heard), 'silent': sorted(self._silent),
                 'plans': len(robot.sol.plans), 'messages ignored': robot.ignored,
                 'longest step [ms]': f'{1e3 * longest:.1f}', 'cycles missed': self._late,
                 'sections late': robot.sections_late,
                 'tracking error [mm]': f'{1e3 * body.tracking_error:.1f}', 'drift [mm]': f'{1e3 * body.drift:.1f}',
                 'localisation error [mm]': f'{1e3 * body.localisation_error:.1f}',
                 'clock error [ms]': f'{1e3 * self.clock_error():.1f}',
                 **{f'{why} messages': count for why, count in self._peers.refused.items()}}
        excess = self._excess(body)
        if excess:
            return Level.ERROR, excess, facts
        if self._agent.trouble or self._silent:
            silent = f'robots {sorted(self._silent)} are silent' if self._silent else ''
            return Level.WARN, self._agent.trouble or silent, facts
        return Level.OK, robot.mode.name.lower(), facts

    def _excess(self, body):
        """Return what is beyond what the proof allows for, in a sentence; empty for nothing."""
        options = self._options
        if monotonic() - self._began > _HUNG:
            return f'the planner has not answered for more than {_HUNG:g} s: the plan in force is driven to its end'
        if self._agent.is_left_out:
            return (f'{self._agent.trouble}; a simulated body outlives its process by the parameter logbook'
                    if options.simulate and not options.logbook else self._agent.trouble)
        if self._body.trouble():
            return self._body.trouble()
        if self._lag > options.tracking_margin:
            return (f'with base_alpha_max {options.base_alpha_max:g} rad/s2 turns in place bring the body '
                    f'{self._lag:.4f} m off its plan, the margin allows for {options.tracking_margin:g} m: let it turn '
                    'slower (u_max), or raise margin and tracking_margin')
        for name, value, limit, unit in (
                ('the body is off its plan by', body.tracking_error + body.drift, options.tracking_margin, 'm'),
                ('the pose may be wrong by', body.localisation_error, options.localisation_margin, 'm'),
                ('the clock differs from that of a peer by', self.clock_error(), 2 * options.clock_margin, 's')):
            if not isnan(value) and value > limit:
                return f'{name} {value:.4f} {unit}, the margin allows for {limit:g} {unit}'
        return ''
