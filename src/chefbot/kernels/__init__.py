"""Numba kernels compiled ahead of the first run."""
