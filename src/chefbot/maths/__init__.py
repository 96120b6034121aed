"""Planar geometry: poses, angles, grids and outlines."""
