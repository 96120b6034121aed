"""Planar geometry: poses, angles, grids of rays."""
