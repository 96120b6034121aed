"""`chefbot robot export urdf` and `chefbot robot check-urdf`: the robot's URDF, and the check of any URDF."""

from __future__ import annotations

from pathlib import Path

from chefbot.cli.robot.descriptions import output
from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import write_into_folder


def run_urdf(robot: str, out: Path | None) -> None:
    """Export the URDF with primitives instead of meshes, which needs no other file."""
    from chefbot.design.export.urdf import urdf

    output(urdf(load_robot(robot)), out)


def run_package(robot: str, folder: Path) -> None:
    """Write a package for a ROS 2 workspace into a folder with the package's name below `folder`."""
    from chefbot.design.export.ros2.workspace import DESCRIPTION, description_package

    home = folder if folder.name == DESCRIPTION else folder / DESCRIPTION
    for path, data in description_package(load_robot(robot)).items():
        write_into_folder(home / path, data)
    output(f"Written: {home}; next, in the workspace: colcon build --packages-select {DESCRIPTION}\n", None)


def run_check(path: Path) -> None:
    """Print the tree of links of a URDF or xacro file. Raises UserError with its first fault."""
    from chefbot.cli.robot.foreign.urdf_given import check_given

    tree = check_given(path)
    for branch in tree:
        details = [part for part in (branch.joint, f"{branch.mass:.4g} kg" if branch.mass else "") if part]
        suffix = f"  ({', '.join(details)})" if details else ""
        output(f"{'  ' * branch.depth}{branch.link}{suffix}\n", None)
    output(f"{len(tree)} links, {sum(branch.mass for branch in tree):.4g} kg\n", None)
