"""`chefbot board test`: the first motions of a newly wired board, step by step, with what to fix."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import typer
from rich.console import Console

from chefbot.board.bring_up import (
    SIDES,
    HandTurn,
    StepResponse,
    WheelRun,
    direction_remedy,
    step_response,
    was_interrupted,
    wheel_findings,
    wheel_speeds,
)
from chefbot.board.imu_chips import chip_name, imu_fault
from chefbot.board.messages import BatteryLine, BoardLine, InertiaLine, MotionLine, UptimeLine
from chefbot.board.status_codes import BoardFlag
from chefbot.cli.board.serial_port import opened_port
from chefbot.cli.board.step_picture import StepCurve, write_picture
from chefbot.design.sizing.robot_file_editor import Change, changed, value_of
from chefbot.devices.bench_board import CLEAR_SECONDS, BenchBoard
from chefbot.errors import UserError
from chefbot.maths.counter_unwrap import wrap_signed
from chefbot.plural import number_of
from chefbot.robot.load import load_robot
from chefbot.robot.quantities import MAX_CALIBRATION, MIN_CALIBRATION
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import write_atomic

console = Console(highlight=False, soft_wrap=True, markup=False)
SLOW_SHARE, STEP_SHARE = 0.3, 0.6
"""Shares of the maximum speed: of the first turn of a wheel, and of the step."""
WHEEL_SECONDS, STEP_SECONDS, REST_SECONDS = 1.5, 2.0, 0.8
LINE_SECONDS = 5.0
"""Time to wait for a line that the board sends once a second or more often, s."""
BUTTON_SECONDS = 20.0
"""Time to press or release the emergency stop button, s."""
METER_TOLERANCE = 0.02
"""Share by which board and meter may differ without a correction."""
ATTEMPTS = 5
"""Number of times that a motion is commanded whose speeds arrived with a pause."""
MIN_UPRIGHT_ACCELERATION = 7.0
"""Acceleration along the IMU's z axis, m/s^2, above which it is upright."""


class BenchMotion(NamedTuple):
    """A commanded motion: the board's lines meanwhile, the ticks of both wheels until they stood, and the flags."""

    lines: list[BoardLine]
    ticks: tuple[int, int]
    flags: int


class BoardTest:
    """The test of one board; each step prints what it found, and `problems` keeps what has to be fixed."""

    def __init__(
        self, board: BenchBoard, robot: Robot, seconds: float = BUTTON_SECONDS, attempts: int = ATTEMPTS
    ) -> None:
        """seconds: time to press or release the emergency stop button. attempts: of motions that are interrupted."""
        self._board, self._robot, self._seconds, self._attempts = board, robot, seconds, attempts
        self.problems: list[str] = []
        self.changes: list[Change] = []
        self.curves: list[StepCurve] = []

    def run(self) -> None:
        """Run all steps; those that need moving wheels only after the robot was lifted."""
        self._identify()
        self._check_battery()
        self._check_imu()
        self._check_emergency_stop()
        for side in (0, 1):
            self._turn_by_hand(side)
        if not typer.confirm(
            "Lift the robot so that both wheels turn freely. May they turn slowly?", default=False
        ):
            console.print("The wheels were not driven: their directions are not tested.")
            return
        self._board.clear_faults()
        left_is_good, right_is_good = self._drive(0), self._drive(1)
        if left_is_good and right_is_good:
            self._step()

    # -- without motion

    def _identify(self) -> None:
        version = self._board.session.version
        if version is not None:
            console.print(f"Board: {version.port}, firmware {version.hash:08X}.")
        if self._board.session.warning is not None:
            self._report(f"{self._board.session.warning}.")

    def _check_battery(self) -> None:
        self._board.until(lambda: self._board.newest(BatteryLine) is not None, LINE_SECONDS)
        line = self._board.newest(BatteryLine)
        if line is None:
            self._report("The board has sent no battery voltage.")
            return
        volts = self._robot.calibration.battery * line.millivolts / 1000.0
        text = typer.prompt(
            f"Battery: {volts:.2f} V. What does your meter show, in V (Enter: no meter)", default=""
        )
        self._judge_voltage(volts, text)

    def _judge_voltage(self, volts: float, text: str) -> None:
        """Compare the board's voltage with what was typed from a meter, empty without one."""
        measured = _number(text) if text else volts
        ratio = self._robot.calibration.battery * measured / volts if volts > 0.0 else math.nan
        if not MIN_CALIBRATION <= ratio <= MAX_CALIBRATION:
            self._report(
                f"'{text}' V is not what the board measures, {volts:.2f} V: look at the meter, or at the board's"
                " voltage divider."
            )
        elif abs(measured / volts - 1.0) > METER_TOLERANCE:
            self._change(("calibration", "battery"), ratio, "measured with a meter; flash the firmware again")

    def _check_imu(self) -> None:
        self._board.until(lambda: self._board.newest(UptimeLine) is not None, LINE_SECONDS)
        self._board.until(lambda: self._board.newest(InertiaLine) is not None, LINE_SECONDS)
        uptime, inertia = self._board.newest(UptimeLine), self._board.newest(InertiaLine)
        if uptime is None or inertia is None:
            self._report(f"{imu_fault(uptime.imu if uptime else 0)}.")
        elif inertia.az < 1000.0 * MIN_UPRIGHT_ACCELERATION:
            self._report(
                f"The IMU's z axis does not point up: it measures {inertia.az / 1000:.1f} m/s^2 along it."
            )
        else:
            console.print(f"IMU: {chip_name(uptime.imu)}, z up.")

    def _check_emergency_stop(self) -> None:
        if not typer.confirm("Is an emergency stop button connected?", default=True):
            return

        def pressed() -> bool:
            return bool(self._flags & BoardFlag.ESTOP_INPUT)

        console.print(f"Press the emergency stop button within {self._seconds:.0f} s.")
        if not self._board.until(pressed, self._seconds):
            self._report("The emergency stop button was not noticed: check its two wires; open is pressed.")
            return
        console.print("Noticed. Release it.")
        for _ in range(round(self._seconds / CLEAR_SECONDS)):
            self._board.clear_faults()  # refused as long as it is pressed
            if not pressed():
                return
        self._report("The emergency stop input stays open: is the button released, and its circuit closed?")

    def _turn_by_hand(self, side: int) -> None:
        question = f"Turns of the {SIDES[side]} wheel that you will make by hand, forward (0: skip)"
        turns = typer.prompt(question, default=5, type=int)
        if turns <= 0:
            return
        before = self._counts()
        typer.prompt(f"Turn the {SIDES[side]} wheel forward by {turns} turns, then press Enter", default="")
        self._board.run(0.2)
        ticks = wrap_signed(self._counts()[side] - before[side])
        self._judge_hand_turn(side, HandTurn(ticks, turns, self._robot.motor.ticks_per_turn))

    def _judge_hand_turn(self, side: int, turn: HandTurn) -> None:
        if turn.agrees:
            console.print(f"{turn.ticks / turn.turns:.0f} ticks per turn, as the robot file has it.")
        elif turn.ticks < 0:
            self._report(f"The {SIDES[side]} encoder counts backward: swap its A and B wires.")
        elif not 0.1 < turn.ratio < 10.0:
            self._report(
                f"The {SIDES[side]} encoder counted {turn.ticks} ticks: check its supply, ground, A and B."
            )
        else:
            self._change(
                ("motor", "gear_ratio"),
                turn.ratio * self._robot.motor.gear_ratio,
                f"{turn.ticks / turn.turns:.0f} ticks per turn",
            )

    # -- with wheels that turn

    def _drive(self, side: int) -> bool:
        """Turn one wheel slowly; return whether it turned as it should."""
        rate, speed = self._speed(SLOW_SHARE)
        run = self._steady(WHEEL_SECONDS, *((speed, 0.0) if side == 0 else (0.0, speed)))
        if run is None:
            return False
        found = wheel_findings(WheelRun(side, run.ticks, rate * WHEEL_SECONDS, run.flags))
        if not found:
            question = (
                f"Did the {SIDES[side].upper()} wheel turn forward? f: forward, b: backward, n: not at all"
            )
            remedy = direction_remedy(side, typer.prompt(question, default="f").strip().lower()[:1])
            found = [remedy] if remedy else []
        for text in found:
            self._report(text)
        self._board.clear_faults()
        if not found:
            console.print(f"The {SIDES[side]} wheel works: {run.ticks[side]} ticks.")
        return not found

    def _step(self) -> None:
        """Measure how both wheels follow a step of the speed."""
        target, speed = self._speed(STEP_SHARE)
        run = self._steady(STEP_SECONDS, speed, speed)
        if run is None:
            return
        for side in (0, 1):
            times, speeds = _speeds_of(run.lines, side)
            if len(times) < 10:
                self._report("The board sent too few lines during the step.")
                return
            response = step_response(times, speeds, target)
            self.curves.append(StepCurve(SIDES[side], times, speeds, target, response))
            self._judge(side, response)

    def _steady(self, seconds: float, left: float, right: float) -> BenchMotion | None:
        """Drive with speeds that arrive without a pause, again after one; None if the computer is too busy."""
        for _ in range(self._attempts):
            before = self._counts()
            lines = self._board.run(seconds, left, right)
            flags = self._flags
            self._board.run(REST_SECONDS)
            after = self._counts()
            if not was_interrupted(lines):
                ticks = (wrap_signed(after[0] - before[0]), wrap_signed(after[1] - before[1]))
                return BenchMotion(lines, ticks, flags)
        self._report(
            "The computer was too busy to send speeds without a pause; end other programs, and test again."
        )
        return None

    def _judge(self, side: int, response: StepResponse) -> None:
        text = (
            f"{SIDES[side]} wheel: 90 % of the speed after {response.rise_time:.2f} s, overshoot"
            f" {100 * response.overshoot:.0f} %, error {100 * response.error:+.1f} %"
        )
        if response.is_good:
            console.print(f"Step of the {text}.")
        else:
            self._report(
                f"Poor step response of the {text}: compare motor and mass of the robot file with yours."
            )

    # -- common

    def _speed(self, share: float) -> tuple[float, float]:
        """Return a share of the board's maximum speed, as ticks/s and rad/s of a wheel."""
        version = self._board.session.version
        rate = share * (version.max_forward if version is not None else 0)
        return rate, rate / self._robot.motor.ticks_per_radian

    @property
    def _flags(self) -> int:
        return self._board.session.flags

    def _counts(self) -> tuple[int, int]:
        self._board.run(0.1)
        line = self._board.newest(MotionLine)
        return (line.left, line.right) if line is not None else (0, 0)

    def _report(self, text: str) -> None:
        self.problems.append(text)
        console.print(f"To fix: {text[0].upper()}{text[1:]}")

    def _change(self, path: tuple[str, ...], value: float, comment: str) -> None:
        self.changes.append(Change(path, f"{value:.4g}", comment))
        console.print(f"The robot file should have {'.'.join(path)}: {value:.4g} ({comment}).")


def _number(text: str) -> float:
    """Return the number that was typed, NaN for any other text."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _speeds_of(lines: list[BoardLine], side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times since the first line, s, and the speeds of a wheel, ticks/s, by the board's clock."""
    motions = [line for line in lines if isinstance(line, MotionLine)]
    if len(motions) < 2:
        return np.empty(0), np.empty(0)
    times = np.array([wrap_signed(line.t - motions[0].t) for line in motions]) / 1e6
    counts = [(line.left, line.right)[side] for line in motions]
    ticks = np.array([wrap_signed(count - counts[0]) for count in counts], np.float64)
    kept = np.concatenate([[True], np.diff(times) > 0.0])
    return times[kept][1:], wheel_speeds(times[kept], ticks[kept])


def run_board_test(
    robot_name: str,
    port: str,
    out: Path,
    write: bool,
    seconds: float = BUTTON_SECONDS,
    attempts: int = ATTEMPTS,
) -> int:
    """Test a board with its owner; write a picture, and the robot file's changes if wanted.

    Returns the exit code: 1 if something has to be fixed.
    """
    robot = load_robot(robot_name)
    if write and not Path(robot_name).is_file():
        raise UserError(f"{robot_name} is a built-in robot and is not changed; --robot takes your own file")
    with opened_port(port) as opened:
        board = BenchBoard(opened, robot)
        board.open()
        test = BoardTest(board, robot, seconds, attempts)
        try:
            test.run()
        except typer.Abort:
            if sys.stdin.isatty():
                raise  # Ctrl-C
            raise UserError("the answers ended before the test did: run it in a terminal") from None
    if test.curves:
        write_picture(test.curves, out)
        console.print(f"Picture of the step: {out}")
    if test.changes:
        _write_changes(test.changes, robot_name, write)
    count = len(test.problems)
    console.print("No problems found." if not count else f"{number_of(count, 'problem')} to fix, see above.")
    return 1 if count else 0


def _write_changes(changes: list[Change], robot_name: str, write: bool) -> None:
    path = Path(robot_name)
    if not path.is_file():
        console.print(f"{robot_name} is a built-in robot and is not changed; --robot takes your own file.")
        return
    text = path.read_text()
    for change in changes:
        if value_of(text, change.path[:1]) is not None:  # a name in place of a section
            console.print(
                f"{path} names its {change.path[0]}: choose the right one, or write its section out."
            )
    changes = [change for change in changes if value_of(text, change.path[:1]) is None]
    if write and changes:
        write_atomic(path, changed(text, changes).encode())
        console.print(f"{path} is changed.")
    elif changes:
        console.print(f"Run it with --write to change {path}.")
