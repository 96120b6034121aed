"""Implementation of `chefbot robot`: functions of a robot file, from the motor sizing to the ROS 2 packages."""
