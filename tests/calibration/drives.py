"""Drives of a robot whose numbers are known, with the ticks, the gyro and the walls that follow from them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.alignment import ScanMatch
from chefbot.calibration.drive import DriveSegment, Square
from chefbot.calibration.wheels import WheelParams
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.load import load_robot

DRAWN = WheelParams.nominal(load_robot("chefbot"))
SENSOR = SE2(0.07, 0.0, 0.0)
FIRM = np.diag([1e6, 1e6, 1e7])
"""Links to a millimetre and a third of a milliradian."""


class Built(NamedTuple):
    """The robot as it is."""

    left: float = 1.0
    right: float = 1.0
    separation: float = 1.0
    yaw: float = 0.0
    gyro_scale: float = 1.0
    gyro_offset: float = 0.0

    @property
    def wheels(self) -> WheelParams:
        return WheelParams(
            DRAWN.left * self.left, DRAWN.right * self.right, DRAWN.separation * self.separation
        )

    @property
    def sensor(self) -> SE2:
        return SE2(SENSOR.x, SENSOR.y, SENSOR.yaw + self.yaw)


def rolled(left: float, right: float, separation: float) -> SE2:
    """Where rims that roll so far lead to, by many small straight steps."""
    n = 4000
    headings = (np.arange(n) + 0.5) / n * (right - left) / separation
    step = (left + right) / 2 / n
    return SE2(
        float(step * np.cos(headings).sum()),
        float(step * np.sin(headings).sum()),
        (right - left) / separation,
    )


class Track:
    """Goes on leg by leg; the driver believes the drawing, the floor knows the robot."""

    def __init__(self, built: Built) -> None:
        self.built, self.pose, self.poses = built, IDENTITY, [built.sensor]
        self.legs: list[DriveSegment] = []
        self.counts = np.zeros(2)

    def go(self, metres: float, angle: float, slip: float = 0.0) -> DriveSegment:
        """An arc as the driver means it; `slip`: metres that the left wheel rolls without getting on."""
        rim = angle * DRAWN.separation / 2
        counts = np.array([(metres - rim) / DRAWN.left + slip / DRAWN.left, (metres + rim) / DRAWN.right])
        ticks: NDArray[np.float64] = self.counts + np.linspace(0.0, 1.0, 41)[:, None] * counts
        self.counts = ticks[-1]
        wheels = self.built.wheels
        motion = rolled(counts[0] * wheels.left - slip, counts[1] * wheels.right, wheels.separation)
        seconds = 2.0 + abs(metres) / 0.3 + abs(angle)
        gyro = self.built.gyro_scale * motion.yaw + self.built.gyro_offset * seconds
        self.pose = self.pose @ motion
        self.poses.append(self.pose @ self.built.sensor)
        last = len(self.poses) - 1
        leg = DriveSegment(np.rint(ticks), gyro, seconds, self.poses[-2], self.poses[-1], (last - 1, last))
        self.legs.append(leg)
        return leg

    def square(self, side: float, turn: int) -> Square:
        """There and back."""
        legs = []
        for _ in range(4):
            legs += [self.go(side, 0.0), self.go(0.0, turn * math.pi / 2)]
        return Square(turn, side, tuple(legs))

    def links(self) -> list[ScanMatch]:
        """Each stand to the last one and to the first."""
        return [
            ScanMatch(first, second, self.poses[first].between(self.poses[second]), FIRM)
            for second in range(1, len(self.poses))
            for first in {0, second - 1}
        ]


def usual(built: Built, squares: int = 1, side: float = 2.0) -> tuple[Track, Sequence[Square]]:
    """Turns on the spot, then squares both ways."""
    track = Track(built)
    for angle in (2 * math.pi, -2 * math.pi, 2 * math.pi):
        track.go(0.0, angle)
    found = [track.square(side, turn) for _ in range(squares) for turn in (1, -1)]
    return track, found
