"""`chefbot robot export ros2`: packages with description, navigation, Gazebo worlds and messages."""

from __future__ import annotations

import os
import shutil
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from chefbot.cli.robot.descriptions import output
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.odometry.params import OdometryParams
from chefbot.robot.load import built_in_robots, find_robot, load_robot
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import write_into_folder

Packages = dict[str, dict[str, bytes]]
"""Package name to path in the package to content."""


def run_ros2(robot: str, out: Path) -> None:
    """Write the packages into the folder `out`, all or none.

    Raises UserError for a robot that cannot navigate or a folder that cannot be written.
    """
    model = load_robot(robot)
    name_or_file = robot if robot in built_in_robots() else str(find_robot(robot).resolve())
    packages = ros2_packages(model, name_or_file)
    _write(out, packages)
    output(
        f"Written to {out}: {', '.join(packages)}; next, in the folder above: colcon build --packages-select"
        f" {' '.join(packages)}\n",
        None,
    )


def ros2_packages(robot: Robot, name_or_file: str) -> Packages:
    """Return all files; loads the CAD libraries. Raises UserError for a robot that cannot navigate."""
    from chefbot.design.export.ros2 import workspace
    from chefbot.design.export.ros2.derived_nav_params import OdometryErrors

    floor = OdometryParams()
    odometry_errors = OdometryErrors(floor.slip, floor.diameter_error, floor.separation_error)
    return {
        workspace.DESCRIPTION: workspace.description_package(robot),
        workspace.BRINGUP: workspace.bringup_package(robot, name_or_file, odometry_errors),
        workspace.GAZEBO: workspace.gazebo_package(robot, _worlds(robot)),
        workspace.MESSAGES: workspace.message_package(),
    }


def _worlds(robot: Robot) -> dict[str, tuple[str, SE2]]:
    """Return name to SDF without the robot, which the launch file spawns, and the start pose."""
    from chefbot.sim.world.load import load_any_world
    from chefbot.sim.world.world import built_in_worlds
    from chefbot.sim.world.world_sdf import world_sdf

    found = {}
    for name in sorted(built_in_worlds()):
        world = load_any_world(name, robot)
        found[name] = _without(world_sdf(robot, world), robot.name), world.start
    return found


def _without(text: str, model: str) -> str:
    """Return the world's text without one of its models."""
    root = ET.fromstring(text)
    world = root.find("world")
    found = None if world is None else world.find(f"model[@name='{model}']")
    if world is None or found is None:
        raise ValueError(f"the world has no model {model}")
    world.remove(found)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _write(out: Path, packages: Packages) -> None:
    """Write into a temporary folder, then rename; on failure everything is removed again."""
    with _os_errors_explained(out):
        _check_free(out, packages)
        created = _make_folder(out)
        moved: list[Path] = []
        try:
            with tempfile.TemporaryDirectory(prefix=".chefbot_ros2_", dir=out) as staging:
                for package, files in packages.items():
                    for path, data in files.items():
                        write_into_folder(Path(staging) / package / path, data)
                for package in packages:
                    os.rename(Path(staging) / package, out / package)  # noqa: PTH104 - replaces an empty folder
                    moved.append(out / package)
        except BaseException:
            for place in [*moved, *created]:
                shutil.rmtree(place, ignore_errors=True)
            raise


def _check_free(out: Path, packages: Packages) -> None:
    if out.exists() and not out.is_dir():
        raise UserError(f"--out {out} is a file; give the src folder of a workspace")
    for package in packages:
        place = out / package
        if place.is_symlink() or (place.exists() and (not place.is_dir() or any(place.iterdir()))):
            raise UserError(f"{place} exists already; move it away or give another --out")


def _make_folder(out: Path) -> list[Path]:
    """Create the folder and its parents; return the uppermost new one, if any."""
    new = [path for path in (out, *out.parents) if not path.exists()]
    out.mkdir(parents=True, exist_ok=True)
    return new[-1:]


@contextmanager
def _os_errors_explained(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise UserError(f"--out {out} cannot be written: {error.strerror or error}") from None
