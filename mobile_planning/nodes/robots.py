"""The robots of one process: one as a rule, several where a fleet is to fit one machine."""
from __future__ import annotations

from rclpy.node import Node

from mobile_planning.nodes.parameters import Parameters
from mobile_planning.nodes.robot import RobotNode
from mobile_planning.nodes.robot_options import RobotOptions


def make_robots(**kwargs) -> list[RobotNode]:
    """Return the nodes of the robots that the parameters name.

    Of several each is named ``robot_<id>``; they share what they hear, the thread that plans, and the one that drives.

    Parameters
    ----------
    **kwargs
        For ``rclpy.node.Node``.

    Raises
    ------
    PlanningError
        A parameter is out of its range, or a robot is not in the scene or has no room there.
    """
    asked = Node('robot', enable_rosout=False, start_parameter_services=False, **kwargs)
    try:
        return _robots(Parameters(asked, RobotOptions).values, kwargs)
    finally:
        # Only now: with the last node the whole participant would go, and in Fast DDS 3.2.2 another process that has
        # just found it and at once loses it may hang for ever (its issue 6502).
        asked.destroy_node()


def _robots(options, kwargs):
    """Return the nodes that are asked for."""
    if not options.is_several:
        return [RobotNode(**kwargs)]
    nodes: list[RobotNode] = []
    try:
        for robot_id in options.ids:
            host = nodes[0].host if nodes else None
            nodes.append(RobotNode(robot_id, host, f'robot_{robot_id}', **kwargs))
    except BaseException:
        for node in nodes:
            node.destroy_node()
        raise
    return nodes
