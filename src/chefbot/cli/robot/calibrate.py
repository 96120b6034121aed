"""`chefbot robot calibrate`: drive, solve, validate, write the robot file."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

from chefbot.calibration.calibrate import CalibrationDrive, CalibrationResult, calibrate
from chefbot.calibration.wheels import WheelParams
from chefbot.cli.robot.calibrate_file import Findings, findings_of, robot_text
from chefbot.cli.robot.calibrate_picture import picture
from chefbot.errors import UserError
from chefbot.launcher.launch_changer import parse_arguments
from chefbot.launcher.session import print_notices, session, start
from chefbot.maths.se2 import SE2
from chefbot.nodes.calibrator import CalibratorNode
from chefbot.robot.load import find_robot, load_robot, parse_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.launch import Launch, load_launch
from chefbot.runtime.node_container import NodeContainer
from chefbot.signals import stop_on_signals
from chefbot.storage.atomic_files import make_folder, write_atomic

NODE = "calibrator"
WHEELS = ("left_wheel", "right_wheel", "separation")
console = Console(highlight=False, soft_wrap=True)


class CalibrateOptions(NamedTuple):
    """Options as on the command line."""

    robot: str
    arguments: list[str]
    sim: bool
    seed: int
    out: Path
    launch: str


class Measured(NamedTuple):
    """Recorded drive. mount: pose of the scanning sensor by the robot file; frame: its name."""

    drive: CalibrationDrive
    mount: SE2
    frame: str
    truth: dict[str, float] | None
    """Ground truth of the simulated robot, only printed."""


def run_calibrate(options: CalibrateOptions) -> None:
    """Drive, calibrate and write the results.

    Raises UserError, and writes no robot file, if the drive fails or its data is insufficient.
    """
    robot, launch = load_robot(options.robot), _launch(options)
    target = options.out / "robot.yaml"
    if target.resolve() == find_robot(options.robot).resolve():
        raise UserError(f"{target} would refer to itself by `like`; give another folder with --out")
    make_folder(options.out)
    measured = _measure(robot, launch, options)
    result = calibrate(measured.drive, WheelParams.of(robot), measured.mount)
    found = findings_of(result, robot, measured.mount, measured.frame)
    text = robot_text(found, options.robot)
    parse_robot(text.encode(), target)
    _write(options.out, text, result, found, measured, robot)
    _print(result, found, measured, robot)
    console.print(f"\nWritten: {target}, calibration.json, calibration.png; use it as --robot {target}")


def _launch(options: CalibrateOptions) -> Launch:
    given = parse_arguments(options.arguments)
    name = "calibrate_sim" if options.sim else options.launch
    given |= {"robot": options.robot, "seed": str(options.seed)}
    if options.sim:
        given |= {"headless": "true"}
    launch = load_launch(name, given)
    if not launch.nodes.get(NODE):
        raise UserError(f"launch {name} has no node {NODE}; let it include calibrate")
    return launch


def _measure(robot: Robot, launch: Launch, options: CalibrateOptions) -> Measured:
    """Drive. Raises UserError with the reason if it ends early; the recording is kept."""
    recording = options.out / "run.mcap"
    speed = 0.0 if options.sim else 1.0
    with session(robot, options.seed, launch.clock, speed, recording) as system:
        system.loop.add_observer(print_notices)
        start(system, launch)
        node = system.nodes[NODE]
        assert isinstance(node, CalibratorNode)
        with stop_on_signals(system.loop.stop):
            system.loop.run(until=lambda: node.finished or node.failure is not None)
        if not node.finished:
            reason = node.failure or "it was interrupted"
            raise UserError(
                f"no calibration: {reason}; no robot file was written, the recording is {recording}"
            )
        scan = node.scan.last
        assert scan is not None
        return Measured(node.drive, node.mount, scan.header.frame_id, _truth(system))


def _truth(system: NodeContainer) -> dict[str, float] | None:
    from chefbot.sim.device import SimulatorDevice

    for node in system.nodes.values():
        if isinstance(node, SimulatorDevice):
            simulation = node.simulation
            built = simulation.as_built
            return {
                "left_wheel": built.left_wheel,
                "right_wheel": built.right_wheel,
                "separation": built.separation,
                "gyro_scale": simulation.gyro_scale,
                "gyro_offset": float(simulation.gyro_offset[2]),
                "lidar_yaw": built.lidar_yaw,
                "camera_yaw": built.camera_yaw,
            }
    return None


def _write(
    out: Path, text: str, result: CalibrationResult, found: Findings, measured: Measured, robot: Robot
) -> None:
    """Write the robot file last: if it exists, all other files do."""
    summary = _summary(result, found, measured, robot)
    write_atomic(out / "calibration.json", (json.dumps(summary, indent=1) + "\n").encode())
    write_atomic(out / "calibration.png", picture(result, found, robot))
    write_atomic(out / "robot.yaml", text.encode())


def _summary(result: CalibrationResult, found: Findings, measured: Measured, robot: Robot) -> dict[str, Any]:
    solution, again = result.solution, result.validation
    return {
        "found": {one.key: {"value": one.value, "deviation": one.deviation} for one in found.values},
        "umbmark": {"E_d": result.umbmark.wheel_ratio, "E_b": result.umbmark.separation_ratio},
        "worst_return_m": _worst_returns(result),
        "found_again_by_the_check": dict(
            zip(WHEELS, again.wheels.factors(WheelParams.nominal(robot)), strict=True)
        ),
        "drives": len(solution.slipped),
        "slipped": int(solution.slipped.sum()),
        "drives_of_the_check": len(again.slipped),
        "slipped_on_the_check": int(again.slipped.sum()),
        "stands": len(measured.drive.stations),
        "links": result.links,
        "noise": {"m": solution.noise[0], "rad": solution.noise[1]},
        "truth_of_the_simulator": measured.truth,
    }


def _worst_returns(result: CalibrationResult) -> dict[str, float]:
    return {
        "before": result.before.worst,
        "after": result.after.worst,
        "after_by_umbmark": result.by_umbmark.worst,
        "check_squares_with_old_numbers": result.after_assumed.worst,
    }


def _print(result: CalibrationResult, found: Findings, measured: Measured, robot: Robot) -> None:
    columns = ["", "before", "found", "standard deviation"]
    truth = measured.truth
    table = Table(*columns, *(["simulator's truth", "off by"] if truth else []), box=None)
    for one in found.values:
        row = [one.key, one.text_of(one.before), one.text_of(one.value), one.text_of(one.deviation)]
        if truth:
            row += [one.text_of(truth[one.key]), one.text_of(one.value - truth[one.key], signed=True)]
        table.add_row(*row)
    console.print(table)
    before, after = result.before.worst, result.after.worst
    ratios, side = result.umbmark, measured.drive.validation_squares[0].side
    console.print(
        f"\nUMBmark: E_d {ratios.wheel_ratio:.5f}, E_b {ratios.separation_ratio:.5f} (mean diameter as assumed)\n"
        f"Systematic error E_max,syst of squares of {side} m: {1000 * before:.0f} mm before, "
        f"{1000 * after:.1f} mm after ({before / max(after, 1e-6):.0f} times less); by UMBmark's numbers "
        f"{1000 * result.by_umbmark.worst:.1f} mm"
    )
    apart = zip(WHEELS, result.validation.wheels, result.solution.wheels, strict=True)
    console.print(
        "Validation on its own drives: "
        + ", ".join(f"{key} {100.0 * (again / first - 1.0):+.3f} %" for key, again, first in apart)
        + " different"
    )
    for slipped, which in ((result.solution.slipped, ""), (result.validation.slipped, " of the validation")):
        if slipped.any():
            console.print(
                f"{int(slipped.sum())} of {len(slipped)} drives{which} were rejected as outliers: "
                "a wheel slipped, or a wall was mistaken for another."
            )
    x, y = found.mount_off
    if math.hypot(x, y) > found.mount_threshold:
        console.print(
            f"The {found.sensor} seems to be mounted {1000 * x:+.0f} mm forward and {1000 * y:+.0f} mm to the "
            f"left of its position in {robot.name}; measure it and correct `sensors` in the robot file."
        )
