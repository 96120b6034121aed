"""The commands of `chefbot board`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli import completion
from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import ROBOT_OPTION

board_app = new_group("Motor board: wiring, find, check, test, flash, monitor, log.")
_BOARD = typer.Option(help="kind of board: mega, tiva or pico; default: board.kind of the robot file")
_PORT = typer.Argument(
    help="path of a serial port, or auto where there is only one", autocompletion=completion.serial_ports
)
_PROGRAM = typer.Option(
    help="file of a firmware image built by `make -C firmware images`; default: the image in this package"
)
_SECONDS = typer.Option(min=0, help="duration, s; 0: until Ctrl-C")


@board_app.command("find")
def find() -> None:
    """List the serial ports with permissions, likely boards first, and print a udev rule if one is needed."""
    from chefbot.cli.board.ports import print_serial_ports

    print_serial_ports()


@board_app.command("check")
def check(port: Annotated[str, _PORT] = "auto") -> None:
    """Check that a motor board answers at a port; exit code 1 with the reason if none does."""
    from chefbot.cli.board.check import check_board

    raise typer.Exit(check_board(port))


@board_app.command("flash")
def flash(
    board: Annotated[str, _BOARD] = "",
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    port: Annotated[
        str,
        typer.Option(
            help="serial port of the board, where its tool needs one", autocompletion=completion.serial_ports
        ),
    ] = "auto",
    program: Annotated[Path | None, _PROGRAM] = None,
) -> None:
    """Flash the firmware for a robot to the motor board."""
    from chefbot.cli.board.flash import run_flash

    raise typer.Exit(run_flash(board, robot, port, program))


@board_app.command("image")
def image(
    board: Annotated[str, _BOARD] = "",
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    program: Annotated[Path | None, _PROGRAM] = None,
    out: Annotated[
        Path | None, typer.Option(help="firmware file to write, .hex, .bin or .uf2; default: a file in runs/")
    ] = None,
) -> None:
    """Write the firmware for a robot to a file, for tools of your own, and list its constants."""
    from chefbot.cli.board.image import run_image

    run_image(board, robot, program, out)


@board_app.command("wiring")
def wiring(
    board: Annotated[str, _BOARD] = "",
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    out: Annotated[Path, typer.Option(help="picture to write, NAME.svg")] = Path("runs/wiring.svg"),
) -> None:
    """Draw the wiring of a robot's motor board: every terminal with its pin."""
    from chefbot.cli.board.wiring import draw_wiring

    draw_wiring(robot, board, out)


@board_app.command("test")
def test(
    port: Annotated[str, _PORT] = "auto",
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    out: Annotated[Path, typer.Option(help="picture of the wheels' step response, NAME.png")] = Path(
        "runs/board_test.png"
    ),
    write: Annotated[
        bool, typer.Option("--write", help="write the measured values to the robot file")
    ] = False,
) -> None:
    """Test a newly wired board step by step: battery, IMU, emergency stop, encoders, directions, step response."""
    from chefbot.cli.board.bring_up import run_board_test

    raise typer.Exit(run_board_test(robot, port, out, write))


@board_app.command("monitor")
def monitor(port: Annotated[str, _PORT] = "auto", seconds: Annotated[float, _SECONDS] = 0.0) -> None:
    """Show the decoded messages of a board: a live table, or lines into a pipe. It does not drive."""
    from chefbot.cli.board.serial_port import run_monitor

    run_monitor(port, seconds)


@board_app.command("log")
def log(
    port: Annotated[str, _PORT] = "auto",
    out: Annotated[Path, typer.Option(help="log file to write")] = Path("runs/board.log"),
    seconds: Annotated[float, _SECONDS] = 0.0,
) -> None:
    """Log the messages of a board as received, with times."""
    from chefbot.cli.board.serial_port import run_log

    run_log(port, out, seconds)


@board_app.command("emulate")
def emulate(
    link: Annotated[Path, typer.Option(help="path at which the emulated serial port is opened")] = Path(
        "runs/board"
    ),
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    world: Annotated[
        str,
        typer.Option(
            help="world in which the board drives a simulated robot with its lidar; default: a board alone",
            autocompletion=completion.worlds,
        ),
    ] = "",
    lidar: Annotated[
        Path, typer.Option(help="path at which the port of the emulated lidar is opened, in a world")
    ] = Path("runs/lidar"),
    profile: Annotated[
        str, typer.Option(help="imperfections of the simulated robot in a world: real, perfect or assembled")
    ] = "real",
    seed: Annotated[int, typer.Option(min=0, help="random seed of the simulated robot in a world")] = 1,
) -> None:
    """Emulate a board: run the firmware on this computer, with modelled motors, at a pseudo-terminal.

    With --world, board and lidar are those of a robot in a simulated world, and lines on the true state are printed.
    """
    from chefbot.cli.board.emulate import run_emulated_robot, run_emulator

    if world:
        raise typer.Exit(run_emulated_robot(robot, world, profile, seed, link, lidar))
    raise typer.Exit(run_emulator(robot, link))
