"""The record of a run: what went in, how it ended, its figures, and the path for a picture."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version

import msgspec

from chefbot import __version__

LIBRARIES = ("numpy", "numba", "llvmlite", "mujoco-core", "scipy")
"""Libraries that the results of a run can depend on."""
RECORD_NAME, LOG_NAME = "record.json", "run.mcap"
"""Files in the folder of a run."""
CANNOT_RUN = "it cannot run: "
"""Beginning of the failure of a run that could not begin."""
LENGTH_BYTES = 8
"""Bytes of the length of a RunSpec, big-endian; the spec follows in MessagePack, as a run's process reads it."""


class GoalRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One goal of a run: its place, when it began and ended (s), and how near the robot truly came (m)."""

    place: str
    began: float
    ended: float
    reached: bool
    distance: float
    reason: str = ""


class RunRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One run of a scenario with one seed.

    key: hash of code, scenario, its files and the seed. success: whether the task was done, all criteria were kept
    and no node raised an exception. failure: why not, a sentence. path: rows (time s, x m, y m) in the world frame.
    plan: the world from above for a picture, PNG, empty for a run without a world; plan_extent: its (left, right,
    bottom, top), m. messages: hash of all messages, equal on every machine. wall_time, cpu_time: s; memory: largest
    resident size, MB.
    """

    key: str
    scenario: str
    seed: int
    success: bool
    failure: str = ""
    figures: dict[str, float] = {}
    goals: list[GoalRecord] = []
    path: list[tuple[float, float, float]] = []
    incidents: list[tuple[float, float, float, str]] = []
    """Collisions and near misses: time (s), position in the world frame (m), and what."""
    plan: bytes = b""
    plan_extent: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)
    messages: str = ""
    sim_time: float = 0.0
    wall_time: float = 0.0
    cpu_time: float = 0.0
    memory: float = 0.0
    machine: dict[str, str] = {}


def machine() -> dict[str, str]:
    """Return what a result can depend on besides the code: processor, its settings for Numba, and versions."""
    from llvmlite.binding import get_host_cpu_name  # type: ignore[import-untyped]

    return {
        "host": platform.node(),
        "architecture": platform.machine(),
        "processor": os.environ.get("NUMBA_CPU_NAME") or get_host_cpu_name(),
        "python": platform.python_version(),
        "chefbot": __version__,
        **{name: version(name) for name in LIBRARIES},
    }
