"""`chefbot urdf`: the robot's URDF, a ROS 2 package with it, or a check of somebody's own URDF or xacro."""

from __future__ import annotations

from pathlib import Path

from chefbot.cli.robot.descriptions import output
from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import write_into_folder


def run_urdf(robot: str, out: Path | None) -> None:
    """The URDF with primitives instead of meshes: it needs no other file."""
    from chefbot.design.export.urdf import urdf

    output(urdf(load_robot(robot)), out)


def run_package(robot: str, folder: Path) -> None:
    """A package for a ROS 2 workspace in a folder of the package's name below `folder`."""
    from chefbot.design.export.ros2.workspace import DESCRIPTION, description_package

    home = folder if folder.name == DESCRIPTION else folder / DESCRIPTION
    for path, data in description_package(load_robot(robot)).items():
        write_into_folder(home / path, data)
    output(f"Written: {home}; next, in the workspace: colcon build --packages-select {DESCRIPTION}\n", None)


def run_check(path: Path) -> None:
    """The tree of somebody's URDF or xacro; UserError with its first fault."""
    from chefbot.cli.robot.urdf_given import check_given

    tree = check_given(path)
    for branch in tree:
        words = [part for part in (branch.joint, f"{branch.mass:.4g} kg" if branch.mass else "") if part]
        told = f"  ({', '.join(words)})" if words else ""
        output(f"{'  ' * branch.depth}{branch.link}{told}\n", None)
    output(f"{len(tree)} links, {sum(branch.mass for branch in tree):.4g} kg\n", None)
