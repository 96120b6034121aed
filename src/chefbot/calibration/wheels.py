"""The motion of a robot by the ticks of its two wheels, with numbers that may be wrong."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot


class Wheels(NamedTuple):
    """What a tick is of each wheel, m, and the separation that the robot turns by, m."""

    left: float
    right: float
    separation: float

    @staticmethod
    def of(robot: Robot) -> Wheels:
        """As the robot file has them, its calibration included."""
        per_tick = 2.0 * math.pi / robot.motor.ticks_per_turn
        return Wheels(robot.left_radius * per_tick, robot.right_radius * per_tick, robot.turning_separation)

    @staticmethod
    def drawn(robot: Robot) -> Wheels:
        """As they are on paper."""
        return Wheels(robot.metres_per_tick, robot.metres_per_tick, robot.wheels.separation)

    def factors(self, drawn: Wheels) -> tuple[float, float, float]:
        """Of left wheel, right wheel and separation by those on paper."""
        return self.left / drawn.left, self.right / drawn.right, self.separation / drawn.separation


def travelled(ticks: NDArray[np.float64], wheels: Wheels) -> SE2:
    """Where counts (n, 2), left and right, read one after the other, lead to from the origin.

    Each step is an arc; its chord has the direction of the middle (Siegwart & Nourbakhsh 2004, 5.2.4).
    """
    rims = np.diff(ticks, axis=0) * (wheels.left, wheels.right)
    turns = (rims[:, 1] - rims[:, 0]) / wheels.separation
    chords = rims.mean(axis=1) * np.sinc(turns / (2.0 * math.pi))
    headings = np.cumsum(turns) - 0.5 * turns
    x, y = float(chords @ np.cos(headings)), float(chords @ np.sin(headings))
    return SE2(x, y, wrap(float(turns.sum())))


def turn_of(ticks: NDArray[np.float64], wheels: Wheels) -> float:
    """Radians turned to the left, whole turns included."""
    left, right = (ticks[-1] - ticks[0]) * (wheels.left, wheels.right)
    return float(right - left) / wheels.separation


def length_of(ticks: NDArray[np.float64], wheels: Wheels) -> float:
    """Metres that the wheels rolled, forth and back, mean of both."""
    return float((np.abs(np.diff(ticks, axis=0)) * (wheels.left, wheels.right)).sum()) / 2.0
