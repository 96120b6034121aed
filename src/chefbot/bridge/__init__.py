"""A running loop as nodes of ROS 2, and nodes of ROS 2 in the loop."""
