"""What robots tell each other: whoever comes late is not told to pass over what was said last, but gets it."""
import pytest
from mobile_planning_msgs.msg import RobotMsg
from rclpy.qos import DurabilityPolicy

from mobile_planning.nodes import qos
from mobile_planning.nodes.fleet_bus import FleetBus
from mobile_planning.nodes.guard import Guard


def test_who_comes_late_hears_what_a_robot_said_last(ros):
    publisher = ros.node.create_publisher(RobotMsg, '/robot_msgs', qos.robot_messages())
    for number in range(3):
        publisher.publish(RobotMsg(sequence=number))
    heard = ros.listen(RobotMsg, '/robot_msgs', qos.robot_messages(16))
    ros.until(lambda: heard)
    publisher.publish(RobotMsg(sequence=3))
    ros.until(lambda: heard[-1].sequence == 3)
    assert [message.sequence for message in heard] == [2, 3]


@pytest.mark.parametrize('topic', ['/robot_msgs', '/contracts', '/joint_plans'])
def test_robots_write_and_read_so_that_nobody_is_told_to_pass_anything_over(ros, topic):
    FleetBus(ros.node, Guard(ros.node), 'map')
    ends = [*ros.node.get_publishers_info_by_topic(topic), *ros.node.get_subscriptions_info_by_topic(topic)]
    assert {end.qos_profile.durability for end in ends} == {DurabilityPolicy.TRANSIENT_LOCAL} and len(ends) == 2
