"""What an executor waits for: timers, subscriptions and the like, gathered once and kept alive meanwhile.

It stands on inner parts of rclpy, as `executor` does.
"""
from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from inspect import iscoroutinefunction, signature
from typing import Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.timer import TimerInfo
from rclpy.waitable import NumberOfEntities, Waitable


#: What a node has, by kind, as rclpy's wait sets and its nodes call it.
_OF_A_NODE = {'timer': 'timers', 'subscription': 'subscriptions', 'service': 'services', 'client': 'clients',
              'guard_condition': 'guards'}
KINDS = tuple(_OF_A_NODE)


def may_run(entity: Any) -> bool:
    """Return whether no coroutine of its group keeps an entity from its turn."""
    return entity.callback_group is not None and entity.callback_group.can_execute(entity)


class Entities:
    """All that an executor waits for; none of it is destroyed before `release`.

    Parameters
    ----------
    context : rclpy.context.Context
    nodes : sequence of rclpy.node.Node
        Whose timers, subscriptions, services, clients and guard conditions are waited for.
    waitables : sequence of rclpy.waitable.Waitable
    alarms : sequence of guard conditions or None
        They end the wait, and nothing is run for them.
    kinds : sequence of str
        Of what the nodes have, only these are waited for.

    Attributes
    ----------
    simple : set
        Timers and subscriptions whose callbacks are no coroutines.
    """

    def __init__(self, context: Context, nodes: Sequence[Node], waitables: Sequence[Waitable], alarms: Sequence,
                 kinds: Sequence[str] = KINDS):
        self._stack = ExitStack()
        self._stack.enter_context(context.handle)
        self._kinds = {kind: self._held(each for node in nodes for each in getattr(node, _OF_A_NODE[kind]))
                       if kind in kinds else [] for kind in KINDS}
        self._alarms = self._held(each for each in alarms if each is not None)
        self._waitables = waitables
        for waitable in self._waitables:
            self._stack.enter_context(waitable)
        self._by_pointer = {each.handle.pointer: each for entities in self._kinds.values() for each in entities}
        self.simple = {each for each in self._kinds['timer'] if _is_simple(each.callback)}
        self.simple |= {each for each in self._kinds['subscription'] if not iscoroutinefunction(each.callback)}
        count = {kind: len(entities) for kind, entities in self._kinds.items()}
        need = sum((waitable.get_num_entities() for waitable in self._waitables),
                   NumberOfEntities(count['subscription'], count['guard_condition'] + len(self._alarms),
                                    count['timer'], count['client'], count['service']))
        self._wait_set = rclpy_implementation.WaitSet(
            need.num_subscriptions, need.num_guard_conditions, need.num_timers, need.num_clients, need.num_services,
            need.num_events, context.handle)

    def release(self) -> None:
        """Let whoever is to be destroyed be destroyed."""
        self._stack.close()

    def wait(self, nanoseconds: int, is_idle: bool) -> dict[str, list]:
        """Return who is ready, by kind; where coroutines wait those whose turn it is not are not waited for."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        for kind, entities in self._kinds.items():
            add = getattr(wait_set, f'add_{kind}')
            for entity in entities if is_idle else filter(may_run, entities):
                add(entity.handle)
        for alarm in self._alarms:
            wait_set.add_guard_condition(alarm.handle)
        waited = [waitable for waitable in self._waitables if is_idle or may_run(waitable)]
        for waitable in waited:
            waitable.add_to_wait_set(wait_set)
        wait_set.wait(nanoseconds)
        ready = {kind: [self._by_pointer[pointer] for pointer in wait_set.get_ready_entities(kind)
                        if pointer in self._by_pointer] for kind in self._kinds}
        ready['waitable'] = [waitable for waitable in waited if waitable.is_ready(wait_set)]
        return ready

    def _held(self, entities):
        held = []
        for entity in entities:
            try:
                self._stack.enter_context(entity.handle)
                held.append(entity)
            except rclpy_implementation.InvalidHandle:
                continue
        return held


def _is_simple(callback):
    """Whether the callback of a timer is no coroutine and asks for nothing."""
    if callback is None or iscoroutinefunction(callback):
        return False
    return not any(each.annotation in (TimerInfo, 'TimerInfo') for each in signature(callback).parameters.values())
