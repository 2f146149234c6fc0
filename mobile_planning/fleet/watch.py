"""Watch: proves while the robots drive that what they publish keeps what they have agreed on, or says where not.

A message of a robot tells its plan and the contracts in force at one instant. Two plans that both keep to one contract
never meet; so each message is judged by itself, whatever was lost before it and however late it comes. Shares no
geometry with what it judges.
"""
from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.invariant import TOLERANCE
from mobile_planning.fleet.message import Contracts, LinkMode, RobotMsg
from mobile_planning.fleet.plan_distances import contract_room, curves, distance_of_point
from mobile_planning.fleet.report import Report

#: Contracts that are kept of each pair.
_KEPT = 12
#: Links of one message that are judged; of more, others each time.
_MOST_LINKS = 24
#: Sentences that are kept.
_MOST_SENTENCES = 100


class Watch:
    """Judges the messages of a fleet as they come.

    Parameters
    ----------
    radii : mapping of int to float [m]
        Of the bodies alone, by robot id.

    Attributes
    ----------
    proofs : int
        Plans that were found to keep to a contract, or clear of a robot at rest.
    unchecked : int
        For which the contract, or the other robot, was not heard.
    violations : list of str
        One sentence for each pair and kind.
    since : float [s]
        When the first message was said; infinite before it comes.
    """

    def __init__(self, radii: Mapping[int, float]):
        self.proofs = self.unchecked = 0
        self.violations: list[str] = []
        self.since = np.inf
        self._radii = dict(radii)
        self._contracts: dict[tuple[int, int], deque[tuple[tuple[int, int, int], Contract]]] = {}
        self._heard: dict[int, tuple[RobotMsg, float]] = {}
        self._said: set[tuple] = set()
        self._turn = 0

    def hear(self, message: RobotMsg | Contracts, stamp: float) -> None:
        """Take in what a robot said at ``stamp`` [s] of the common clock; older messages than the newest say nothing.
        """
        self.since = min(self.since, stamp)
        if isinstance(message, Contracts):
            for offer in message.offers:
                kept = self._contracts.setdefault((message.robot_id, offer.peer_id), deque(maxlen=_KEPT))
                key = message.boot_epoch, offer.peer_epoch, offer.contract.id
                if all(known != key for known, _ in kept):
                    kept.append((key, offer.contract))
            return
        known = self._heard.get(message.robot_id)
        if message.plan is None or known is not None and (
                (message.boot_epoch, message.sequence) <= (known[0].boot_epoch, known[0].sequence)):
            return
        self._heard[message.robot_id] = message, stamp
        # Only contracts can be judged message by message; of other methods the bodies are compared, see `look`.
        peers = sorted(message.links) if message.method == 'contracts' else []
        if len(peers) > _MOST_LINKS:
            self._turn += _MOST_LINKS
            peers = [peers[(self._turn + index) % len(peers)] for index in range(_MOST_LINKS)]
        whole = curves(message.plan, message.plan.first_knot, len(message.plan.points) - 2) if peers else None
        for peer in peers:
            self._judge(message, peer, message.links[peer], whole)

    def look(self, now: float) -> None:
        """Compare where all robots are at ``now`` [s] by the plans of the last cycle."""
        fresh = [message for message, stamp in self._heard.values()
                 if 0.0 <= now - stamp <= 2 * message.plan.step and message.robot_id in self._radii]
        places = np.array([message.plan.state(now)[:2] for message in fresh]).reshape(-1, 2)
        for i, one in enumerate(fresh):
            for j in range(i):
                distance, other = float(np.linalg.norm(places[i] - places[j])), fresh[j]
                need = self._radii[one.robot_id] + self._radii[other.robot_id]
                if distance < need - TOLERANCE:
                    self._say('overlap', one.robot_id, other.robot_id,
                              f'are {distance:.4f} m apart at {now:.3f} s, their radii need {need:.4f} m')

    def summed_up(self, report: Report, start: float) -> Report:
        """Return the report on a mission that began at ``start`` [s], with all that was found while it was driven."""
        since = max(0.0, self.since - start) if start > 0.0 and np.isfinite(self.since) else 0.0
        return replace(report, valid=report.valid and not self.violations, watched_since=since,
                       violations=[*report.violations, *self.violations])

    def _judge(self, message, peer, link, whole):
        """Judge the plan of a message, ``whole`` as Bezier curves, by what it says of one link."""
        room = None
        if link.mode is LinkMode.CON:
            contract = self._contract(message, peer, link)
            if contract is not None:
                room = contract_room(contract, message.plan, message.plan.first_knot, message.robot_id < peer,
                                     message.radius, whole)
        elif link.mode is LinkMode.STATIC:
            room = self._room_beside(message, peer)
        else:
            return
        if room is None:
            self.unchecked += 1
        elif room >= -TOLERANCE:
            self.proofs += 1
        else:
            what = f'contract {link.contract}' if link.mode is LinkMode.CON else 'robot at rest'
            self._say(link.mode, message.robot_id, peer, f'have a {what} that the plan {message.plan_seq} of robot '
                                                         f'{message.robot_id} breaks by {-room:.6f} m')

    def _contract(self, message, peer, link):
        """Return the contract that a link names; None if it was not heard."""
        if message.robot_id < peer:
            pair, key = (message.robot_id, peer), (message.boot_epoch, link.epoch, link.contract)
        else:
            pair, key = (peer, message.robot_id), (link.epoch, message.boot_epoch, link.contract)
        return next((contract for known, contract in self._contracts.get(pair, ()) if known == key), None)

    def _room_beside(self, message, peer):
        """Return how far [m] a plan stays from a robot at rest; None if that is not known to rest."""
        other = self._heard[peer][0] if peer in self._heard else None
        if other is None or np.ptp(other.plan.points, axis=0).any():
            return None
        return distance_of_point(message.plan, other.plan.end, message.plan.first_knot) - message.radius - other.radius

    def _say(self, kind, one, other, sentence):
        pair = tuple(sorted((one, other)))
        if (kind, *pair) not in self._said and len(self._said) < _MOST_SENTENCES:
            self._said.add((kind, *pair))
            self.violations.append(f'robots {pair[0]} and {pair[1]} {sentence}')
