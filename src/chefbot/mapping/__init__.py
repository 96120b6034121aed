"""Occupancy grids: the map as ROS knows it, and its files."""
