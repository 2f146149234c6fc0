"""The ROS 2 nodes: wiring between the library and the wire."""
