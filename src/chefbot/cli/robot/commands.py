"""The commands of `chefbot robot`; those of `chefbot robot export` are in `export_commands`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli import completion
from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import AS_JSON, KEY_VALUES, ROBOT_ARGUMENT, ROBOT_OPTION
from chefbot.cli.robot.export_commands import export_app

robot_app = new_group("Robot file: design, generate, check, draw, export, calibrate.")


@robot_app.command("list")
def list_robots() -> None:
    """List the built-in robots with their size, mass, speed and payload."""
    from chefbot.cli.robot.built_in import list_robots

    list_robots()


@robot_app.command("design")
def design(
    robot: Annotated[str, ROBOT_ARGUMENT] = "chefbot",
    payload: Annotated[str | None, typer.Option(help="payload, as 6, '6 kg' or '13 lb'")] = None,
    speed: Annotated[str | None, typer.Option(help="maximum speed, in m/s or with a unit")] = None,
    acceleration: Annotated[str | None, typer.Option(help="maximum acceleration, m/s^2")] = None,
    slope: Annotated[str | None, typer.Option(help="steepest ramp, degrees")] = None,
    run_time: Annotated[str | None, typer.Option(help="run time of one battery charge, hours")] = None,
    wheel: Annotated[str | None, typer.Option(help="wheel diameter, m")] = None,
    radius: Annotated[str | None, typer.Option(help="radius of the plates, m")] = None,
    write: Annotated[Path | None, typer.Option(help="robot file to write, with the selected parts")] = None,
    as_json: Annotated[bool, AS_JSON] = False,
) -> None:
    """Size motors, driver and battery, with all calculations; select parts and write a robot file."""
    from chefbot.cli.robot.design import run_design

    overrides = {
        "payload": payload,
        "speed": speed,
        "acceleration": acceleration,
        "slope": slope,
        "run-time": run_time,
        "wheel": wheel,
        "radius": radius,
    }
    run_design(robot, overrides, write, as_json)


@robot_app.command("generate")
def generate(
    seed: Annotated[int, typer.Option(min=0, help="random seed; same seed, same robot")] = 1,
    numbers: Annotated[
        list[str] | None,
        typer.Option("--set", help="a number to set instead of drawing it, NAME=VALUE; repeatable"),
    ] = None,
    out: Annotated[Path, typer.Option(help="robot file to write")] = Path("robot.yaml"),
) -> None:
    """Generate a robot by a seed: size, speed and sensors drawn, motors and battery sized, everything checked."""
    from chefbot.cli.robot.generate import run_generate

    run_generate(seed, numbers or [], out)


@robot_app.command("check")
def check(
    robot: Annotated[str, ROBOT_ARGUMENT],
    as_json: Annotated[bool, AS_JSON] = False,
    out: Annotated[
        Path | None, typer.Option(help="picture to write, NAME.png: the robot from above, overlaps in red")
    ] = None,
) -> None:
    """Check a robot before it is built; exit code 1 with errors, 0 with warnings only."""
    from chefbot.cli.robot.check import run_check

    raise typer.Exit(run_check(robot, as_json, out))


@robot_app.command("check-urdf")
def check_urdf(
    file: Annotated[Path, typer.Argument(help="URDF or xacro file to check, from any source")],
) -> None:
    """Check a URDF or xacro file and print its tree of links."""
    from chefbot.cli.robot.urdf import run_check

    run_check(file)


@robot_app.command("draw")
def draw(
    sheets: Annotated[
        list[str],
        typer.Argument(
            help="part: base_plate, middle_plate, top_plate, pole, tube, motor_clamp, caster, assembly; or all"
        ),
    ],
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    out: Annotated[Path, typer.Option(help="folder for DXF, PNG and PDF")] = Path("runs/drawings"),
) -> None:
    """Draw the robot's parts to scale, with dimensions."""
    from chefbot.cli.robot.draw import run_drawing

    run_drawing(sheets, robot, out)


@robot_app.command("calibrate")
def calibrate(
    robot: Annotated[str, ROBOT_ARGUMENT] = "chefbot",
    arguments: Annotated[
        list[str] | None,
        typer.Argument(help="arguments of the launch, such as squares:=2 or board_port:=/dev/ttyACM0"),
    ] = None,
    sim: Annotated[bool, typer.Option("--sim", help="use an uncalibrated simulated robot")] = False,
    seed: Annotated[int, typer.Option(min=0, help="random seed of the simulated robot's errors")] = 1,
    out: Annotated[Path, typer.Option(help="folder for robot.yaml, report and recording")] = Path("runs/cal"),
    launch: Annotated[
        str, typer.Option(help="launch file that includes calibrate and the driver of your lidar or camera")
    ] = "calibrate",
) -> None:
    """Drive turns and squares to calibrate wheels, gyro and the sensor's yaw; write a robot file."""
    from chefbot.cli.robot.calibrate import CalibrateOptions, run_calibrate

    run_calibrate(CalibrateOptions(robot, arguments or [], sim, seed, out, launch))


@robot_app.command("service")
def service(
    launch: Annotated[
        str,
        typer.Argument(help="launch of a built robot, or a launch file", autocompletion=completion.launches),
    ] = "robot_standalone",
    arguments: Annotated[list[str] | None, KEY_VALUES] = None,
    user: Annotated[str, typer.Option(help="user that the launch runs as; default: the current one")] = "",
    out: Annotated[Path, typer.Option(help="unit file to write")] = Path("chefbot.service"),
) -> None:
    """Write a systemd unit that starts a built robot with its computer, and again when it crashes or hangs."""
    from chefbot.cli.robot.service import run_service

    run_service(launch, arguments or [], user, out)


robot_app.add_typer(export_app, name="export")
