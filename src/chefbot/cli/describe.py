"""`chefbot sdf` and `chefbot mjcf`, and what all descriptions of a robot do with their text."""

from __future__ import annotations

import sys
from pathlib import Path

from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import write_into_folder


def run_sdf(robot: str, world: str | None, out: Path | None) -> None:
    """The robot as a model for Gazebo, or a whole world with the robot at its start."""
    from chefbot.design.export.sdf import sdf

    machine = load_robot(robot)
    if world is None:
        deliver(sdf(machine), out)
        return
    from chefbot.sim.world.load import load_any_world
    from chefbot.sim.world.world_sdf import world_sdf

    deliver(world_sdf(machine, load_any_world(world, machine)), out)


def run_mjcf(robot: str, out: Path | None) -> None:
    """The robot on a floor for MuJoCo: the text that our simulator has, without a world."""
    from chefbot.design.export.mjcf import mjcf

    deliver(mjcf(load_robot(robot)), out)


def deliver(text: str, out: Path | None) -> None:
    """To the file, whose folder is made if need be, or to stdout."""
    if out is None:
        sys.stdout.write(text)
        return
    write_into_folder(out, text.encode())
