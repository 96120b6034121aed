"""The modules between a twist and the wheels, each with the tests that have to cover it and to kill its mutants."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

REPOSITORY = Path(__file__).parents[3]
SOURCE = REPOSITORY / "src"


def _safety(*names: str) -> tuple[str, ...]:
    return tuple(f"tests/safety/test_{name}.py" for name in names)


def _nodes(*names: str) -> tuple[str, ...]:
    return tuple(f"tests/nodes/test_{name}.py" for name in names)


MODULES: dict[str, tuple[str, ...]] = {
    "chefbot.safety.emergency_stop": _safety("emergency_stop"),
    "chefbot.control.kinematics": ("tests/control/test_kinematics.py",),
    "chefbot.safety.stop_latch": _safety("stop_latch"),
    "chefbot.safety.command_multiplexer": _safety("command_multiplexer"),
    "chefbot.safety.velocity_limiter": _safety("velocity_limiter", "params"),
    "chefbot.safety.speed_limit": _safety("speed_limit"),
    "chefbot.safety.cliff_stop": _safety("cliff_stop"),
    "chefbot.odometry.tilt_detector": ("tests/odometry/test_tilt_detector.py",),
    "chefbot.safety.params": _safety("params"),
    "chefbot.safety.monitor_text": _safety("monitor_text"),
    "chefbot.safety.ranger_freshness": _safety("ranger_freshness"),
    "chefbot.safety.latency": _safety("latency"),
    "chefbot.safety.motion_policy": _safety("motion_policy"),
    "chefbot.robot.motion_limits": ("tests/robot/test_motion_limits.py",),
    "chefbot.safety.monitor_polygons": _safety("monitor_polygons"),
    "chefbot.safety.sensor_freshness": _safety("sensor_freshness", "freshness_limits"),
    "chefbot.safety.known_obstacles": _safety("blind_sensors", "obstacle_sensors"),
    "chefbot.safety.obstacle_sensors": _safety("obstacle_sensors", "blind_sensors", "lidar_scatter"),
    "chefbot.safety.contact_time": _safety("contact_time", "contact_edges"),
    "chefbot.safety.local_memory": _safety("local_memory", "memory_limits", "ray_clearing"),
    "chefbot.safety.collision_monitor": _safety("collision_monitor", "monitor_limits", "monitor_scans"),
    "chefbot.nodes.emergency_stop": _nodes("base_stop"),
    "chefbot.nodes.drive_base": _nodes("drive_base", "base_stop", "zones"),
    "chefbot.nodes.collision_monitor": _nodes("base_sensors", "base_stop", "drive_base"),
}
"""By the name of the module, those with few mutants first. `chefbot.safety` itself holds no code."""
KERNELS = frozenset({"chefbot.safety.contact_time", "chefbot.safety.local_memory"})
"""Modules that Numba compiles: in machine code nothing is measured and nothing exchanged, so they run as Python."""
MEASURED_TOGETHER = (tuple(sorted(KERNELS)), tuple(name for name in MODULES if name not in KERNELS))
"""Modules whose tests run in one process."""


def without_compiler(modules: Collection[str]) -> dict[str, str]:
    """Return the environment variables with which some modules are measured."""
    return {"NUMBA_DISABLE_JIT": "1" if KERNELS & set(modules) else "0"}


def path_of(module: str) -> Path:
    """Return the file of a module."""
    return SOURCE / f"{module.replace('.', '/')}.py"


def name_of(path: Path) -> str:
    """Return the name of the module in a file."""
    return ".".join(path.relative_to(SOURCE).with_suffix("").parts)
