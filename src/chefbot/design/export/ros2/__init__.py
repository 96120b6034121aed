"""The ROS 2 workspace of a robot: parameters with their reasons, launch files, bridges, pictures' settings."""
