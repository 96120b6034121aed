"""The commands of `chefbot robot export`: the robot for other programs and machines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from chefbot.cli import completion
from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import OUT_FILE, ROBOT_ARGUMENT, START, UNKNOWN, WORLDS
from chefbot.errors import UserError

export_app = new_group("Export the robot: URDF, SDF, MJCF, ROS 2 packages, solids.")


@export_app.command("urdf")
def urdf(
    robot: Annotated[str, ROBOT_ARGUMENT] = "chefbot",
    out: Annotated[Path | None, OUT_FILE] = None,
    package: Annotated[
        Path | None,
        typer.Option(help="folder for the ROS 2 package chefbot_description, with xacro and meshes"),
    ] = None,
) -> None:
    """Export the robot as URDF for RViz and Gazebo, or as a ROS 2 package with xacro and meshes."""
    from chefbot.cli.robot.urdf import run_package, run_urdf

    if out is not None and package is not None:
        raise UserError("--out writes a file and --package a folder; give one of them")
    if package is not None:
        run_package(robot, package)
    else:
        run_urdf(robot, out)


@export_app.command("sdf")
def sdf(
    robot: Annotated[str, ROBOT_ARGUMENT] = "chefbot",
    world: Annotated[str | None, typer.Option(help=WORLDS, autocompletion=completion.worlds)] = None,
    out: Annotated[Path | None, OUT_FILE] = None,
    start: Annotated[str, START] = "",
    unknown: Annotated[str, UNKNOWN] = "auto",
) -> None:
    """Export the robot, or a world with the robot in it, as SDF for Gazebo."""
    from chefbot.cli.robot.descriptions import run_sdf

    run_sdf(robot, world, out, start, unknown)


@export_app.command("mjcf")
def mjcf(
    robot: Annotated[str, ROBOT_ARGUMENT] = "chefbot",
    out: Annotated[Path | None, OUT_FILE] = None,
) -> None:
    """Export the robot as MJCF for MuJoCo, as the simulator uses it."""
    from chefbot.cli.robot.descriptions import run_mjcf

    run_mjcf(robot, out)


@export_app.command("ros2")
def ros2(
    out: Annotated[
        Path, typer.Option(help="src folder of a ROS 2 workspace, into which four packages are written")
    ],
    robot: Annotated[str, ROBOT_ARGUMENT] = "chefbot",
) -> None:
    """Export ROS 2 packages: description, launch files, Nav2 parameters with reasons, Gazebo worlds."""
    from chefbot.cli.robot.ros2 import run_ros2

    run_ros2(robot, out)


@export_app.command("solids")
def solids(
    robot: Annotated[str, ROBOT_ARGUMENT] = "chefbot",
    form: Annotated[
        Literal["stl", "glb", "obj", "step"],
        typer.Option(
            "--format",
            help="file format: stl for 3-D printers, glb for viewers, obj for older programs, step for CAD",
        ),
    ] = "stl",
    part: Annotated[
        str,
        typer.Option(help="part to export, such as base_plate; all: every part; assembly: the whole robot"),
    ] = "all",
    mm: Annotated[
        bool, typer.Option("--mm", help="write stl and obj in millimetres instead of metres")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="output folder for stl and obj, output file for glb and step; default: in runs/"),
    ] = None,
) -> None:
    """Export the parts and the assembly as solids, with the bill of materials and a picture."""
    from chefbot.cli.robot.solids import run_model

    run_model(robot, form, part, mm, out)
