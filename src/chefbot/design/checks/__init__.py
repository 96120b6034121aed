"""Faults of a robot's geometry and drive before anything is built."""
