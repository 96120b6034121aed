"""Implementation of `chefbot doctor`: the state of this computer and of the ROS graph."""
