"""Warning for a robot whose obstacle sensors see one plane only."""

from __future__ import annotations

from collections.abc import Iterator

from chefbot.design.checks.finding import Finding
from chefbot.robot.motion_limits import one_plane_warning
from chefbot.robot.spec import Robot


def check_one_plane(robot: Robot) -> Iterator[Finding]:
    """Return a warning if the robot has a lidar and no depth camera: its speed is limited."""
    sentence = one_plane_warning(robot)
    if sentence:
        yield Finding(
            "warning", "one plane", "lidar", sentence, 0.0, 1.0, "cameras", True, "sensors.depth_camera", ""
        )
