"""Compilation of the Numba kernels ahead of the first run."""
