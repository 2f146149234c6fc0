"""MissionServices: what people and programs may ask of a mission."""
from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from mobile_planning_msgs.srv import DeclareDead
from rclpy.node import Node
from std_srvs.srv import Trigger

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.mission import Mission
from mobile_planning.nodes.guard import Guard, tell_sentence


class MissionServices:
    """``~/start``, ``~/stop``, ``~/pause``, ``~/resume`` and ``~/declare_dead``.

    Parameters
    ----------
    node : rclpy.node.Node
        That has them.
    guard : Guard
    mission : Mission
    now : callable
        Returns the common time [s].
    announce, certify : callable
        Tell the robots what is new of the mission; who is dead.
    """

    def __init__(self, node: Node, guard: Guard, mission: Mission, now: Callable[[], float],
                 announce: Callable[[], None], certify: Callable[[], None]):
        self._mission, self._now, self._announce, self._certify = mission, now, announce, certify
        for name, act, sentence in (
                ('start', lambda: mission.start(monotonic()), 'the mission starts when every robot hears every other'),
                ('stop', lambda: mission.stop('it was stopped by ~/stop', monotonic()),
                 'the robots finish their plans and stay'),
                ('pause', mission.pause, 'the robots come to rest and wait'),
                ('resume', mission.resume, 'the robots drive on')):
            node.create_service(Trigger, f'~/{name}', guard.service(self._trigger(act, sentence), tell_sentence))
        node.create_service(DeclareDead, '~/declare_dead', guard.service(self._on_declare_dead, tell_sentence))

    def _trigger(self, act, sentence):
        """Return the callback of a service that acts, tells the robots and answers."""
        def callback(_request, response):
            act()
            self._announce()
            response.success, response.message = True, sentence
            return response
        return callback

    def _on_declare_dead(self, request, response):
        if len(request.place) not in (0, 2):
            raise InvalidInput(f'a place has two coordinates, not {len(request.place)}')
        death = self._mission.declare_dead(request.robot_id, request.place or None, monotonic(), self._now())
        self._certify()
        x, y = death.place
        response.success, response.message = True, f'robot {death.robot_id} counts as dead at ({x:.3f}, {y:.3f})'
        return response
