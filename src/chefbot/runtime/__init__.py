"""Nodes, ports, loop, clocks, launch files, recordings."""
