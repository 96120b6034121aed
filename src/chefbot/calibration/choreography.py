"""Choreography of the calibration drive: which step comes next, from what was measured so far."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from chefbot.calibration.calibrate import CalibrationDrive
from chefbot.calibration.drive import DriveSegment, Square
from chefbot.calibration.params import CalibratorParams
from chefbot.calibration.record import Motion, MotionRecorder, StationRecorder
from chefbot.calibration.steps import LEG, CalibrationDriveError, Look, Notice, Step, Straight, Turn
from chefbot.calibration.wiring import wiring_fault
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.spec import Robot

SIDE_LENGTHS = (2.5, 2.0, 1.5, 1.0)
"""Side lengths of the squares, m; the first one with enough free space is used."""
MARGIN = 0.25
"""Minimum clearance between the robot's footprint on the square and obstacles, m."""
MIN_WALL_FRACTION = 0.1
"""Minimum fraction of beams that must hit a wall."""
PROBE, PROBE_TURN = 0.15, 0.6
"""First careful motions, m and rad, which show whether wheels, encoders and gyro are wired correctly."""
HOME_DISTANCE, HOME_ANGLE = 0.03, math.radians(1.5)
"""Tolerances of the return to the start of a square, m and rad."""
SCAN_TIMEOUT = 5.0
"""Maximum time without a scan, or until the first one, s."""
NO_SCANS = f"no scans for {SCAN_TIMEOUT:.0f} s; the launch needs the driver of a lidar or of a depth camera"
MIN_TURN = 0.03
"""Angle below which the robot does not turn, rad."""


class Choreography:
    """The calibration drive: turns, then squares in both directions, twice: to calibrate by and to check it.

    `steps` yields what to do next; each step must be done, and its measurements recorded, before the next is taken.
    reach: maximum range of the sensor that is used, m.
    """

    def __init__(self, robot: Robot, params: CalibratorParams, reach: float) -> None:
        self._robot, self._params, self._reach = robot, params, reach
        self.motion = MotionRecorder()
        self.room = StationRecorder(reach, robot.circumscribed_radius)
        self._mount = IDENTITY
        self.legs: list[DriveSegment] = []
        self.squares: list[Square] = []
        self.checks: list[Square] = []

    @property
    def drive(self) -> CalibrationDrive:
        """Return the measurements so far: the stations and the segments and squares between them."""
        return CalibrationDrive(self.room.stations, self.legs, self.squares, self.checks)

    def finish_station(self, mount: SE2, motion: Motion | None) -> None:
        """Add the station whose scans are complete, and the leg that led to it with `motion`.

        mount: pose of the scanning sensor in base_link, from the robot file.
        """
        self._mount = mount
        self.room.finish(mount)
        self.motion.restart()
        if motion is not None:
            self.legs.append(self.room.leg(motion))

    def steps(self) -> Iterator[Step]:
        """Yield the steps of the drive; CalibrationDriveError if it cannot go on."""
        yield Notice(
            "Stand clear. The robot turns on the spot, then drives squares; STOP or any key ends it."
        )
        yield Look(ends_leg=False)
        yield from self._probe()
        yield from self._scan_around(1)
        side = self._largest_side()
        for turn in (-1.0, 1.0):
            yield Turn(turn * 2.0 * math.pi)
            yield LEG
        yield from self._scan_around(-1)
        home = self.room.sensor_pose
        yield from self._squares(home, side, self.squares, "to calibrate by")
        yield from self._squares(home, side, self.checks, "to check it")

    def _probe(self) -> Iterator[Step]:
        """Move a little forward, left, right and back; raise an error if wheels, encoders or gyro are miswired."""
        if self.room.hit_ratio < MIN_WALL_FRACTION:
            raise CalibrationDriveError(
                f"the sensor sees walls with {100 * self.room.hit_ratio:.0f} % of its beams within "
                f"{self._reach:.0f} m; calibrate in a room"
            )
        for metres, angle in ((PROBE, 0.0), (0.0, PROBE_TURN), (0.0, -PROBE_TURN), (-PROBE, 0.0)):
            yield Straight(metres) if metres else Turn(angle)
            yield LEG
            sentence = wiring_fault(self.legs[-1], metres, angle)
            if sentence:
                raise CalibrationDriveError(sentence)

    def _scan_around(self, turn: int) -> Iterator[Step]:
        """Turn once around in steps of half the field of view, so that consecutive scans overlap by half."""
        steps = math.ceil(2.0 * math.pi / (0.5 * min(self.room.field_of_view, math.pi)))
        for _ in range(steps):
            yield from _turn(turn * 2.0 * math.pi / steps)
            yield LEG

    def _squares(self, home: SE2, side: float, squares: list[Square], purpose: str) -> Iterator[Step]:
        """Drive squares to the left and to the right in turn, and record each one."""
        count = 2 * self._params.squares
        for number in range(count):
            turn, direction = (1, "left") if number % 2 == 0 else (-1, "right")
            yield Notice(f"Square {number + 1} of {count} {purpose}, {side} m, to the {direction}.")
            yield from self._square(home, side, turn)
            squares.append(Square(turn, side, tuple(self.legs[-8:])))

    def _square(self, home: SE2, side: float, turn: int) -> Iterator[Step]:
        """Drive one square; both directions cover the same ground.

        A square to the right starts along the last side of the one to the left.
        """
        yield from self._return_to(home if turn > 0 else home @ SE2(0.0, 0.0, math.pi / 2))
        for _ in range(4):
            yield Straight(side)
            yield LEG
            yield Turn(turn * math.pi / 2)
            yield LEG

    def _return_to(self, target: SE2) -> Iterator[Step]:
        """Return to a sensor pose by scan matching."""
        base = self._mount.inverse()
        for _ in range(3):
            direction = (self.room.sensor_pose @ base).between(target @ base)
            distance = math.hypot(direction.x, direction.y)
            if distance > HOME_DISTANCE:
                bearing = math.atan2(direction.y, direction.x)
                backwards = abs(bearing) > math.pi / 2
                yield from _turn(wrap(bearing + math.pi) if backwards else bearing)
                yield Straight(-distance if backwards else distance)
                yield LEG
            heading_error = wrap(target.yaw - self.room.sensor_pose.yaw)
            if abs(heading_error) > HOME_ANGLE:
                yield from _turn(heading_error)
                yield LEG
            elif distance <= HOME_DISTANCE:
                return

    def _largest_side(self) -> float:
        """Return the largest side length with enough free space ahead and to the left; raise an error if none."""
        points = self._mount.apply(self.room.walls)
        gap = self._robot.circumscribed_radius + MARGIN
        sides = (self._params.side,) if self._params.side else SIDE_LENGTHS
        for side in sides:
            distance = np.hypot(*(np.maximum(np.abs(points - side / 2) - side / 2, 0.0)).T)
            if not (distance < gap).any():
                return side
        raise CalibrationDriveError(
            f"there is no room for a square of {sides[-1]:.1f} m; put the robot in a corner of a free square of "
            f"{sides[-1] + 2 * gap:.1f} m, {gap:.1f} m from its edges, looking along one with the room to its left"
        )


def _turn(angle: float) -> Iterator[Turn]:
    if abs(angle) >= MIN_TURN:
        yield Turn(angle)


def raise_on_error(code: int, sentence: str) -> None:
    """Raise CalibrationDriveError if a motion has failed."""
    if code:
        raise CalibrationDriveError(
            f"the robot did not get on: {sentence[:1].lower()}{sentence[1:].rstrip('.')}"
        )
