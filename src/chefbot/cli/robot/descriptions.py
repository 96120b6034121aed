"""`chefbot robot export sdf` and `mjcf`, and the output of all text exports."""

from __future__ import annotations

import sys
from pathlib import Path

from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import write_into_folder


def run_sdf(robot: str, world: str | None, out: Path | None, start: str = "", unknown: str = "auto") -> None:
    """Export the robot as a Gazebo model, or a world with the robot at its start pose."""
    from chefbot.design.export.sdf import sdf

    model = load_robot(robot)
    if world is None:
        output(sdf(model), out)
        return
    from chefbot.sim.world.load import load_any_world, unknown_cells
    from chefbot.sim.world.world_sdf import world_sdf

    output(world_sdf(model, load_any_world(world, model, start, unknown_cells(unknown))), out)


def run_mjcf(robot: str, out: Path | None) -> None:
    """Export the robot on a floor as MJCF: the text that the simulator uses, without a world."""
    from chefbot.design.export.mjcf import mjcf

    output(mjcf(load_robot(robot)), out)


def output(text: str, out: Path | None) -> None:
    """Write the text to a file, whose folder is created if necessary, or to standard output."""
    if out is None:
        sys.stdout.write(text)
        return
    write_into_folder(out, text.encode())
