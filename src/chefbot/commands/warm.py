"""Kernels are compiled once after an installation; this shows it instead of letting the robot stall."""

from __future__ import annotations

from rich.console import Console


def warm_kernels(console: Console) -> None:
    """Compile what is not in the cache yet."""
