"""Cameras of the simulated robot: what they see, rendered by ray casting on the CPU."""
