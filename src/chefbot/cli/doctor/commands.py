"""The commands of `chefbot doctor`."""

from __future__ import annotations

from typing import Annotated

import typer

from chefbot.cli.command_group import new_group

doctor_app = new_group(
    "Check this computer: web UI, disk, maps, ports, clock, ROS graph. The exit code is 1 if there are problems.",
    short_help="Check this computer: web UI, disk, maps, ports, clock, ROS graph.",
    no_args_is_help=False,
    invoke_without_command=True,
)


@doctor_app.callback()
def doctor(
    ctx: typer.Context,
    everything: Annotated[
        bool,
        typer.Option(
            "--all", help="also show libraries, tools to build firmware, and a udev rule for all boards"
        ),
    ] = False,
    built: Annotated[
        str,
        typer.Option(
            "--built", metavar="ROBOT", help="robot file of a built robot, whose devices are checked as well"
        ),
    ] = "",
    board_port: Annotated[str, typer.Option(help="with --built: port of the motor board")] = "",
    lidar_port: Annotated[str, typer.Option(help="with --built: port of the lidar")] = "",
    imu_port: Annotated[str, typer.Option(help="with --built: port of the IMU")] = "",
) -> None:
    """Check this computer: web UI, disk, maps, ports, clock, ROS graph; the exit code is 1 if there are problems."""
    if ctx.invoked_subcommand is None:
        from chefbot.cli.doctor.report import print_report
        from chefbot.errors import UserError

        ports = {"board": board_port, "lidar": lidar_port, "imu": imu_port}
        if any(ports.values()) and not built:
            raise UserError(
                "--board-port, --lidar-port and --imu-port are of a built robot: give --built ROBOT, too"
            )
        if print_report(everything=everything, built=built, ports=ports):
            raise typer.Exit(1)


@doctor_app.command("kernels")
def kernels() -> None:
    """Compile the numeric kernels now, as the first launch would."""
    from rich.console import Console

    from chefbot.kernels.precompile import compile_kernels

    console = Console(highlight=False)
    compile_kernels(console)
    console.print("All kernels are compiled.")
