"""The recorder is a node: where ROS is missing it is not even looked at."""
from importlib.util import find_spec

collect_ignore = [] if find_spec('rclpy') and find_spec('mobile_planning_msgs') else ['recorder.py']
