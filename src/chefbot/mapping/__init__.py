"""Occupancy grids as in ROS, and their file formats."""
