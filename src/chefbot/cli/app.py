"""One command: `chefbot VERB`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from chefbot import __version__
from chefbot.cli.error_handling import ended, find_a_place_for_kernels
from chefbot.cli.keys import keys_app
from chefbot.errors import UserError
from chefbot.ros2.tools.apps import add_tools

ROBOTS = "chefbot, chefbot_lidar, desk, porter, or a robot file"
WORLDS = "hotel, room, workshop, empty, a world file, or any ROS map.yaml"
LAN = typer.Option("--lan", help="serve the page to phones in this network: prints its address as a QR code")

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="One file describes a differential-drive robot; chefbot gives its owner the rest.",
)


@app.callback(invoke_without_command=True)
def version(
    show: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", is_eager=True)
    ] = False,
) -> None:
    """Options before the verb."""
    if show:
        print(__version__)
        raise typer.Exit


@app.command()
def demo(
    world: Annotated[str, typer.Option(help="hotel, room, a world file, or any ROS map.yaml")] = "hotel",
    robot: Annotated[str, typer.Option(help=ROBOTS)] = "chefbot",
    seed: Annotated[int, typer.Option(min=0, help="of all chance: the same seed gives the same run")] = 1,
    headless: Annotated[bool, typer.Option("--headless", help="without the page")] = False,
    speed: Annotated[str, typer.Option(help="times real time, or max")] = "max",
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/demo"),
    profile: Annotated[str, typer.Option(help="real or perfect")] = "real",
    people: Annotated[int, typer.Option(min=0, max=50, help="who walk about")] = 0,
    port: Annotated[int, typer.Option(min=1, max=65535, help="of the page")] = 8080,
    processes: Annotated[
        bool, typer.Option("--processes", help="as four processes over the wire, at 4 x real time at most")
    ] = False,
    lan: Annotated[bool, LAN] = False,
) -> None:
    """Map a hotel alone, forget everything, localize on the saved map, carry food to tables and come home."""
    from chefbot.demo.demo import DemoOptions, run_demo

    options = DemoOptions(world, robot, seed, headless, speed, out, profile, people, port, processes, lan)
    raise typer.Exit(run_demo(options))


@app.command()
def launch(
    name: Annotated[str, typer.Argument(help="a launch, such as gmapping_demo, or a launch file")] = "",
    arguments: Annotated[list[str] | None, typer.Argument(help="key:=value ...")] = None,
    join: Annotated[
        list[str] | None, typer.Option(help="another machine's wire, tls/HOST; repeatable")
    ] = None,
    listen: Annotated[
        list[str] | None, typer.Option(help="tcp/ADDRESS: let anybody in there, without keys or secrecy")
    ] = None,
    host: Annotated[str, typer.Option(help="run what has this `host:`; default: this machine's name")] = "",
    lan: Annotated[bool, LAN] = False,
) -> None:
    """Run a launch file; without a name, list them."""
    from chefbot.launcher.launch import list_launches, run_launch

    if not name:
        list_launches()
        return
    raise typer.Exit(run_launch(name, arguments or [], join or [], listen or [], host, lan))


@app.command()
def slam(
    log: Annotated[Path, typer.Argument(help="a CARMEN log, .log or .log.gz")],
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/slam"),
    particles: Annotated[int, typer.Option(min=1, max=1000)] = 30,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    max_range: Annotated[
        float, typer.Option(min=0.1, max=1000, help="ranges beyond are no returns, m")
    ] = 80.0,
) -> None:
    """Make a map from a recorded log: trajectory.tum, map.yaml, map.pgm, map.png."""
    from chefbot.cli.slam import run_slam

    run_slam(log, out, particles, seed, max_range)


@app.command()
def replay(
    log: Annotated[Path, typer.Argument(help="a run.mcap")],
    check: Annotated[
        bool, typer.Option("--check", help="exit 1 unless every output is the same to the byte")
    ] = False,
) -> None:
    """Run a recorded log through its nodes again."""
    from chefbot.cli.replay import run_replay

    raise typer.Exit(run_replay(log, check))


@app.command()
def deliver(
    tables: Annotated[list[str], typer.Argument(help="where to: 3 7 5, or names of places")],
    page: Annotated[str, typer.Option(help="page of the running robot")] = "http://127.0.0.1:8080",
    wait: Annotated[bool, typer.Option("--wait/--no-wait", help="until the robot is home again")] = True,
) -> None:
    """Send a running robot to tables, one after the other."""
    from chefbot.cli.remote import order_delivery

    raise typer.Exit(order_delivery(tables, page, wait))


@app.command("round")
def press_round(
    press: Annotated[
        Literal["", "loaded", "taken", "not-taken", "go-on", "kitchen", "end"],
        typer.Argument(
            help="the food is on the tray; the guest has it; nobody takes it; after STOP or an errand: "
            "go on, back to the kitchen, end the round. Nothing: say what it waits for"
        ),
    ] = "",
    page: Annotated[str, typer.Option(help="page of the running robot")] = "http://127.0.0.1:8080",
) -> None:
    """What people press during a round of deliveries: Loaded, Taken, and how it goes on after STOP."""
    from chefbot.cli.remote import press_round

    raise typer.Exit(press_round(press, page))


@app.command("map_saver")
def map_saver(
    file: Annotated[Path, typer.Option("-f", help="name of the map, without ending")] = Path("map"),
    page: Annotated[str, typer.Option(help="page of the running robot")] = "http://127.0.0.1:8080",
) -> None:
    """Save the map of a running robot as NAME.pgm and NAME.yaml."""
    from chefbot.cli.remote import save_running_map

    save_running_map(file, page)


@app.command()
def design(
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
    payload: Annotated[str | None, typer.Option(help="6, '6 kg' or '13 lb'")] = None,
    speed: Annotated[str | None, typer.Option(help="m/s, or with a unit")] = None,
    acceleration: Annotated[str | None, typer.Option(help="m/s^2")] = None,
    slope: Annotated[str | None, typer.Option(help="steepest ramp, degrees")] = None,
    run_time: Annotated[str | None, typer.Option(help="of one charge, hours")] = None,
    wheel: Annotated[str | None, typer.Option(help="diameter, m")] = None,
    radius: Annotated[str | None, typer.Option(help="of the plates, m")] = None,
    write: Annotated[Path | None, typer.Option(help="robot file with the choice")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="as JSON, in SI units")] = False,
) -> None:
    """Size motors, driver and battery: every sum with its numbers, the catalogue judged, the choice written."""
    from chefbot.cli.design import run_design

    asked = {
        "payload": payload,
        "speed": speed,
        "acceleration": acceleration,
        "slope": slope,
        "run-time": run_time,
        "wheel": wheel,
        "radius": radius,
    }
    run_design(robot, asked, write, as_json)


@app.command()
def calibrate(
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
    arguments: Annotated[
        list[str] | None,
        typer.Argument(help="key:=value of the launch, such as squares:=2 or board_port:=/dev/ttyACM0"),
    ] = None,
    sim: Annotated[bool, typer.Option("--sim", help="a simulated robot that was never calibrated")] = False,
    seed: Annotated[int, typer.Option(min=0, help="which simulated robot")] = 1,
    out: Annotated[Path, typer.Option(help="folder for robot.yaml, report and recording")] = Path("runs/cal"),
    launch: Annotated[
        str, typer.Option(help="launch file that includes calibrate and the driver of your lidar or camera")
    ] = "calibrate",
) -> None:
    """Drive turns and squares; find wheels, gyro and the sensor's yaw; write a robot file with them."""
    from chefbot.cli.calibrate import CalibrateOptions, run_calibrate

    run_calibrate(CalibrateOptions(robot, arguments or [], sim, seed, out, launch))


@app.command()
def urdf(
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
    out: Annotated[Path | None, typer.Option(help="file, instead of the screen")] = None,
    package: Annotated[
        Path | None, typer.Option(help="folder that gets the ROS 2 package chefbot_description")
    ] = None,
    check: Annotated[Path | None, typer.Option(help="somebody's URDF or xacro file to look through")] = None,
) -> None:
    """The robot as URDF for RViz, Gazebo and the like; as a ROS 2 package with xacro and meshes; or a check."""
    from chefbot.cli.urdf import run_check, run_package, run_urdf

    if sum(way is not None for way in (out, package, check)) > 1:
        raise UserError("--out, --package and --check are different things to do; give one of them")
    if check is not None:
        run_check(check)
    elif package is not None:
        run_package(robot, package)
    else:
        run_urdf(robot, out)


@app.command()
def sdf(
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
    world: Annotated[str | None, typer.Option(help=WORLDS)] = None,
    out: Annotated[Path | None, typer.Option(help="file, instead of the screen")] = None,
) -> None:
    """The robot, or a world with the robot in it, for Gazebo."""
    from chefbot.cli.describe import run_sdf

    run_sdf(robot, world, out)


@app.command()
def ros2(
    out: Annotated[Path, typer.Option(help="the src folder of a ROS 2 workspace: gets four packages")],
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
) -> None:
    """ROS 2 packages of the robot: model, launches, Nav2's parameters with their reasons, Gazebo's worlds."""
    from chefbot.cli.ros2 import run_ros2

    run_ros2(robot, out)


@app.command()
def dds(
    domain: Annotated[int | None, typer.Option(help="of DDS; without it ROS_DOMAIN_ID, else 0")] = None,
    topics: Annotated[
        list[str] | None, typer.Option(help="only this one, such as /scan or '/robot1/*'; may be repeated")
    ] = None,
    interface: Annotated[str, typer.Option(help="lo, eth0, ...; auto: Cyclone DDS chooses a network")] = "",
) -> None:
    """Bridge to ROS 2 systems that speak DDS, as default installations do: topics both ways. Needs extra `dds`."""
    from chefbot.cli.dds import run_dds

    run_dds(domain, topics or [], interface)


@app.command()
def mjcf(
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
    out: Annotated[Path | None, typer.Option(help="file, instead of the screen")] = None,
) -> None:
    """The robot for MuJoCo, as the simulator has it."""
    from chefbot.cli.describe import run_mjcf

    run_mjcf(robot, out)


@app.command()
def drawing(
    sheets: Annotated[
        list[str],
        typer.Argument(
            help="base_plate, middle_plate, top_plate, pole, tube, motor_clamp, caster, assembly, or all"
        ),
    ],
    robot: Annotated[str, typer.Option(help=ROBOTS)] = "chefbot",
    out: Annotated[Path, typer.Option(help="folder for DXF, PNG and PDF")] = Path("runs/drawings"),
) -> None:
    """Draw the robot's parts with their dimensions, true to scale."""
    from chefbot.cli.drawing import run_drawing

    run_drawing(sheets, robot, out)


@app.command()
def check(
    robot: Annotated[str, typer.Argument(help=ROBOTS)],
    as_json: Annotated[bool, typer.Option("--json", help="as JSON, in SI units")] = False,
    out: Annotated[Path | None, typer.Option(help="PNG of the robot from above, overlaps in red")] = None,
) -> None:
    """Look for what is wrong with a robot before it is built; exit code 1 with errors, 0 with warnings only."""
    from chefbot.cli.check import run_check

    raise typer.Exit(run_check(robot, as_json, out))


@app.command()
def model(
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
    form: Annotated[
        Literal["stl", "glb", "obj", "step"],
        typer.Option("--format", help="for printers, viewers, old programs, CAD"),
    ] = "stl",
    part: Annotated[str, typer.Option(help="a part such as base_plate, all, or assembly")] = "all",
    mm: Annotated[bool, typer.Option("--mm", help="stl and obj in millimetres, not metres")] = False,
    out: Annotated[
        Path | None, typer.Option(help="folder of stl and obj, file of glb and step; default in runs/")
    ] = None,
) -> None:
    """Every part and the whole robot as solids, the bill of materials, and a picture."""
    from chefbot.cli.model import run_model

    run_model(robot, form, part, mm, out)


board_app = typer.Typer(no_args_is_help=True, help="The motor board: emulate one, watch one, log one.")
app.add_typer(board_app, name="board")
firmware_app = typer.Typer(no_args_is_help=True, help="The firmware of the motor board.")
app.add_typer(firmware_app, name="firmware")
app.add_typer(keys_app, name="keys")
add_tools(app)
_PORT = typer.Argument(help="a serial port's path, or auto where there is only one")
_SECONDS = typer.Option(min=0, help="how long; 0: until Ctrl-C")


@board_app.command("emulate")
def board_emulate(
    link: Annotated[Path, typer.Option(help="where it can be opened like a serial port")] = Path(
        "runs/board"
    ),
    robot: Annotated[str, typer.Option(help=ROBOTS)] = "chefbot",
) -> None:
    """Run the firmware on this computer, with modelled motors: a board without a board."""
    from chefbot.cli.board import run_emulator

    raise typer.Exit(run_emulator(robot, link))


@board_app.command("monitor")
def board_monitor(port: Annotated[str, _PORT] = "auto", seconds: Annotated[float, _SECONDS] = 0.0) -> None:
    """What a board says, decoded: a live table, or line by line into a pipe. It does not drive."""
    from chefbot.cli.board import run_monitor

    run_monitor(port, seconds)


@board_app.command("log")
def board_log(
    port: Annotated[str, _PORT] = "auto",
    out: Annotated[Path, typer.Option(help="file")] = Path("runs/board.log"),
    seconds: Annotated[float, _SECONDS] = 0.0,
) -> None:
    """Keep what a board says as it came, with times."""
    from chefbot.cli.board import run_log

    run_log(port, out, seconds)


@firmware_app.command("header")
def firmware_header(
    robot: Annotated[str, typer.Argument(help=ROBOTS)] = "chefbot",
    out: Annotated[Path | None, typer.Option(help="file, instead of the screen")] = None,
) -> None:
    """The robot's numbers as the C header that the firmware is compiled with."""
    from chefbot.cli.firmware import run_header

    run_header(robot, out)


@app.command()
def flash(
    board: Annotated[str, typer.Option(help="mega, tiva or pico")],
    robot: Annotated[str, typer.Option(help=ROBOTS)] = "chefbot",
    port: Annotated[str, typer.Option(help="serial port of the board, where its tool asks for one")] = "auto",
) -> None:
    """Compile the firmware for a robot and write it to its motor board."""
    from chefbot.cli.firmware import run_flash

    raise typer.Exit(run_flash(board, robot, port))


@app.command()
def doctor() -> None:
    """What of this computer matters to the robot: ports, permissions, tools; prints the udev rule for the board."""
    from chefbot.cli.doctor import run_doctor

    run_doctor()


def main() -> None:
    """Run a verb; bad input is one sentence on stderr and exit code 2."""
    find_a_place_for_kernels()
    with ended():
        app()
