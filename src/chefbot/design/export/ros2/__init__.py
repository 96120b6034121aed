"""The ROS 2 workspace of a robot: static packages, generated parameters with their reasons."""
