"""`chefbot urdf`: the robot's URDF, a ROS 2 package with it, or a check of somebody's own URDF or xacro."""

from __future__ import annotations

from pathlib import Path

from chefbot.commands.describe import deliver
from chefbot.robot.load import load_robot


def run_urdf(robot: str, out: Path | None) -> None:
    """The URDF with primitives instead of meshes: it needs no other file."""
    from chefbot.design.urdf import urdf

    deliver(urdf(load_robot(robot)), out)
