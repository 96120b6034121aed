"""Implementation of `chefbot map`: saving, building and comparing occupancy grid maps."""
