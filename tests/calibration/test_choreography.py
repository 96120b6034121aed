"""The choreography: its order of steps in a simulated room, and the reasons to give up."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.calibration.choreography import (
    HOME_ANGLE,
    HOME_DISTANCE,
    NO_SCANS,
    PROBE,
    Choreography,
    raise_on_error,
)
from chefbot.calibration.params import CalibratorParams
from chefbot.calibration.record import SCANS_PER_STATION, MotionRecorder, mean_pose
from chefbot.calibration.steps import CalibrationDriveError, Look, Notice, Straight, Turn
from chefbot.calibration.wiring import board_error
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot_lidar")
ANGLES = -math.pi + 2.0 * math.pi / 360 * np.arange(360)
TICKS_PER_METRE, SEPARATION = 4000.0, 0.3


class Room:
    """A rectangle around the robot, which moves exactly as it is commanded."""

    def __init__(self, west: float, east: float, south: float, north: float, reach: float = 8.0) -> None:
        self.walls = (west, east, south, north)
        self.pose, self.counts = IDENTITY, np.zeros(2)
        self.ticks_per_metre = TICKS_PER_METRE
        self.choreography = Choreography(ROBOT, CalibratorParams(squares=1), reach)
        self.steps: list[Notice | Straight | Turn | Look] = []

    def scan(self) -> LaserScan:
        x, y = np.cos(self.pose.yaw + ANGLES), np.sin(self.pose.yaw + ANGLES)
        west, east, south, north = self.walls
        with np.errstate(divide="ignore"):
            ranges = np.minimum(
                np.where(x > 0, (east - self.pose.x) / x, (west - self.pose.x) / x),
                np.where(y > 0, (north - self.pose.y) / y, (south - self.pose.y) / y),
            )
        step = float(ANGLES[1] - ANGLES[0])
        return LaserScan(
            Header(), -math.pi, float(ANGLES[-1]), step, 0.0, 0.1, 0.1, 12.0, ranges.astype(np.float32)
        )

    def take(self, step: Notice | Straight | Turn | Look) -> None:
        self.steps.append(step)
        if isinstance(step, Straight):
            self._move(SE2(step.metres, 0.0, 0.0), step.metres, step.metres)
        elif isinstance(step, Turn):
            arc = step.angle * SEPARATION / 2
            self._move(SE2(0.0, 0.0, step.angle), -arc, arc)
        elif isinstance(step, Look):
            motion = self.choreography.motion.motion if step.ends_leg else None
            self.choreography.room.begin()
            added = [self.choreography.room.add(self.scan(), self.pose) for _ in range(SCANS_PER_STATION + 1)]
            assert added == [False] * (SCANS_PER_STATION - 1) + [True, False]
            self.choreography.finish_station(IDENTITY, motion)

    def _move(self, motion: SE2, left: float, right: float) -> None:
        recorder = self.choreography.motion
        recorder.add_ticks(*(round(count) for count in self.counts))
        recorder.add_rate(0.0, 0)
        for i in range(1, 11):
            recorder.add_rate(motion.yaw, i * 100_000_000)
        self.counts += np.array([left, right]) * self.ticks_per_metre
        recorder.add_ticks(*(round(count) for count in self.counts))
        self.pose = self.pose @ motion

    def drive(self) -> None:
        for step in self.choreography.steps():
            self.take(step)


@pytest.mark.slow
def test_the_drive_ends_where_its_squares_began() -> None:
    room = Room(-1.5, 2.5, -1.2, 2.7)
    room.drive()
    drive = room.choreography.drive
    assert [square.turn for square in (*drive.squares, *drive.validation_squares)] == [1, -1, 1, -1]
    assert all(len(square.legs) == 8 and square.side == 2.0 for square in drive.squares)
    assert len(drive.stations) == len(drive.legs) + 1
    assert [leg.stations for leg in drive.legs] == [(i, i + 1) for i in range(len(drive.legs))]
    looks = [step for step in room.steps if isinstance(step, Look)]
    assert [look.ends_leg for look in looks] == [False] + [True] * len(drive.legs)
    notices = [step.sentence for step in room.steps if isinstance(step, Notice)]
    assert len(notices) == 5 and "Square 2 of 2 to check it" in notices[-1]
    first, last = drive.squares[0].legs[0].begin, drive.squares[0].legs[-1].end
    assert first.distance(last) <= HOME_DISTANCE and abs(wrap(first.yaw - last.yaw)) <= HOME_ANGLE


@pytest.mark.slow
def test_the_first_steps_are_small() -> None:
    room = Room(-1.5, 2.5, -1.2, 2.7)
    room.drive()
    moves = [step for step in room.steps if isinstance(step, Straight | Turn)]
    assert moves[0] == Straight(PROBE) and all(abs(move[0]) <= 1.0 for move in moves[:4])


def test_a_room_that_is_too_small_names_the_required_size() -> None:
    with pytest.raises(CalibrationDriveError, match=r"no room for a square of 1\.0 m"):
        Room(-0.8, 0.8, -0.8, 0.8).drive()


def test_without_walls_in_reach_it_does_not_move() -> None:
    room = Room(-7.0, 7.0, -7.0, 7.0, reach=7.0)
    with pytest.raises(CalibrationDriveError, match="calibrate in a room"):
        room.drive()
    assert not any(isinstance(step, Straight | Turn) for step in room.steps)


def test_reversed_encoders_are_named_after_the_first_motion() -> None:
    room = Room(-1.5, 2.5, -1.2, 2.7)
    room.ticks_per_metre = -TICKS_PER_METRE
    with pytest.raises(CalibrationDriveError, match="both encoders"):
        room.drive()
    assert len([step for step in room.steps if isinstance(step, Straight | Turn)]) <= 2


def test_the_goals_of_motions_keep_their_signs() -> None:
    back, right = Straight(-0.5).goal(ROBOT), Turn(-1.0).goal(ROBOT)
    assert back.target.x == -0.5 and back.speed < 0.0 and back.time_allowance.seconds > 10.0
    assert right.target_yaw == -1.0 and right.time_allowance.seconds > 10.0


def test_a_failed_motion_ends_the_drive() -> None:
    raise_on_error(0, "")
    with pytest.raises(CalibrationDriveError, match=r"did not get on: it took too long$"):
        raise_on_error(701, "It took too long.")
    assert "5 s" in NO_SCANS


@given(st.lists(st.tuples(st.floats(-2.0, 2.0), st.integers(1, 999_999_999)), min_size=1, max_size=20))
def test_the_gyro_is_integrated_over_the_time_of_each_reading(readings: list[tuple[float, int]]) -> None:
    recorder, stamp_ns = MotionRecorder(), 0
    recorder.add_rate(9.0, stamp_ns)
    for rate, pause_ns in readings:
        stamp_ns += pause_ns
        recorder.add_rate(rate, stamp_ns)
    motion = recorder.motion
    assert motion.seconds == pytest.approx(stamp_ns / 1e9)
    assert motion.angle == pytest.approx(sum(rate * pause for rate, pause in readings) / 1e9, abs=1e-9)
    recorder.add_rate(1.0, stamp_ns + 2_000_000_000)
    assert recorder.motion.seconds == pytest.approx(stamp_ns / 1e9), "a gap is not integrated"


def test_the_counts_of_a_leg_begin_with_the_last_ones_before() -> None:
    recorder = MotionRecorder()
    assert recorder.counted == (0, 0)
    for count in (10, 30, 20):
        recorder.add_ticks(count, -count)
    assert recorder.counted == (20, 20)
    recorder.restart()
    recorder.add_ticks(25, -20)
    assert recorder.motion.ticks.tolist() == [[20, -20], [25, -20]]


@given(st.floats(-math.pi, math.pi), st.floats(-0.1, 0.1))
def test_the_mean_pose_is_right_across_the_wraparound_of_yaw(yaw: float, spread: float) -> None:
    mean = mean_pose([SE2(1.0, 2.0, yaw + spread), SE2(3.0, 2.0, yaw - spread)])
    assert (mean.x, mean.y) == (2.0, 2.0) and wrap(mean.yaw - yaw) == pytest.approx(0.0, abs=1e-9)


def test_only_an_error_of_the_board_counts() -> None:
    status = [DiagnosticStatus(OK, "board", "Fine."), DiagnosticStatus(ERROR, "base", "Other.")]
    assert not board_error(DiagnosticArray(Header(), tuple(status)))
    status.append(DiagnosticStatus(ERROR, "board", "Motors off."))
    assert board_error(DiagnosticArray(Header(), tuple(status))) == "Motors off."
