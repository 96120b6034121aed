"""Dead reckoning from encoder counts with given wheel parameters."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot


class WheelParams(NamedTuple):
    """The wheel parameters: metres per tick of each wheel and effective wheel separation, m."""

    left: float
    right: float
    separation: float

    @staticmethod
    def of(robot: Robot) -> WheelParams:
        """Return the wheels of a robot file, including its calibration."""
        return WheelParams(
            robot.left_wheel_radius / robot.motor.ticks_per_radian,
            robot.right_wheel_radius / robot.motor.ticks_per_radian,
            robot.effective_wheel_separation,
        )

    @staticmethod
    def nominal(robot: Robot) -> WheelParams:
        """Return the nominal wheels, without calibration."""
        return WheelParams(robot.metres_per_tick, robot.metres_per_tick, robot.wheels.separation)

    def factors(self, drawn: WheelParams) -> tuple[float, float, float]:
        """Return the ratios of left wheel, right wheel and separation to the nominal ones."""
        return self.left / drawn.left, self.right / drawn.right, self.separation / drawn.separation


def integrate_ticks(ticks: NDArray[np.float64], wheels: WheelParams) -> SE2:
    """Return the motion from the origin by encoder counts (n, 2) of left and right wheel.

    Each step is an arc; its chord has the heading at the middle of the arc (Siegwart & Nourbakhsh 2004,
    5.2.4).
    """
    # Wheel travel, yaw increment and chord of each step
    travel = np.diff(ticks, axis=0) * (wheels.left, wheels.right)
    turns = (travel[:, 1] - travel[:, 0]) / wheels.separation
    chords = travel.mean(axis=1) * np.sinc(turns / (2.0 * math.pi))
    # Sum of the chords at the mid-arc headings
    headings = np.cumsum(turns) - 0.5 * turns
    x, y = float(chords @ np.cos(headings)), float(chords @ np.sin(headings))
    return SE2(x, y, wrap(float(turns.sum())))


def distance_from_ticks(ticks: NDArray[np.float64], wheels: WheelParams) -> float:
    """Return the distance rolled back and forth, m, as the mean of both wheels."""
    return float((np.abs(np.diff(ticks, axis=0)) * (wheels.left, wheels.right)).sum()) / 2.0
