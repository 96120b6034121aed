"""UMBmark: systematic odometry errors of a differential drive from squares driven in both directions.

Borenstein & Feng, Measurement and correction of systematic odometry errors in mobile robots, IEEE
Transactions on Robotics and Automation 12 (6), 1996. A wrong separation changes the corners and unequal
wheels bend the sides; squares in both directions separate the two. The mean diameter is not observable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.drive import Square
from chefbot.calibration.errors import CalibrationError
from chefbot.calibration.wheels import WheelParams, integrate_ticks
from chefbot.maths.se2 import SE2

ROUNDS = 12
"""Iterations: the paper's formulas are linear in the errors, and become exact by iterating."""


class ReturnErrors(NamedTuple):
    """The return position errors of the squares, true minus odometry: (n, 2) m for each direction.

    Axes: x along the first side, y along the last one, into the square: as the paper has them.
    """

    left: NDArray[np.float64]
    right: NDArray[np.float64]

    @property
    def worst(self) -> float:
        """E_max,syst: the further of the two clusters' centres of gravity, m (the paper's equation 3)."""
        return max(math.hypot(*self.left.mean(axis=0)), math.hypot(*self.right.mean(axis=0)))


def return_errors(squares: Sequence[Square], wheels: WheelParams, sensor: SE2) -> ReturnErrors:
    """Return true minus odometry position at the end of each square, in the frame of its start.

    sensor: pose of the scanning sensor in base_link. Raise CalibrationError unless both directions were driven.
    """
    errors: dict[int, list[tuple[float, float]]] = {1: [], -1: []}
    for square in squares:
        truth = sensor @ square.seen @ sensor.inverse()
        odometry = integrate_ticks(square.ticks, wheels)
        errors[square.turn].append((truth.x - odometry.x, truth.y - odometry.y))
    if not (errors[1] and errors[-1]):
        raise CalibrationError(
            "UMBmark needs a square to the left and one to the right; let the robot drive both"
        )
    return ReturnErrors(np.array(errors[1]), np.array(errors[-1]))


class Umbmark(NamedTuple):
    """The UMBmark ratios: wheel_ratio E_d (right / left diameter), separation_ratio E_b (true / assumed
    separation)."""

    wheel_ratio: float
    separation_ratio: float

    def corrected(self, wheels: WheelParams) -> WheelParams:
        """Return corrected wheels with the same mean diameter (the paper's equations 16 and 20)."""
        left, right = 2.0 / (self.wheel_ratio + 1.0), 2.0 / (1.0 / self.wheel_ratio + 1.0)
        return WheelParams(
            wheels.left * left, wheels.right * right, wheels.separation * self.separation_ratio
        )


def umbmark_step(errors: ReturnErrors, side: float, separation: float) -> Umbmark:
    """Return E_d and E_b by the paper's formulas, from the centres of gravity along x.

    alpha is the error of each corner (type A), beta of each side (type B), which is an arc of radius R. As in
    the paper, b is the robot's own separation.
    """
    x_left, x_right = float(errors.left[:, 0].mean()), float(errors.right[:, 0].mean())
    alpha, beta = (x_right + x_left) / (-4.0 * side), (x_right - x_left) / (-4.0 * side)
    # The formulas are linear in small angles only
    if abs(alpha) > 0.4 or abs(beta) > 0.8:
        raise CalibrationError(
            f"the squares end {max(abs(x_left), abs(x_right)):.2f} m from the odometry pose, too far for a square "
            f"of {side:.1f} m; look at wheels.diameter and wheels.separation in the robot file"
        )
    # R = (L / 2) / sin(beta / 2), E_d = (R + b / 2) / (R - b / 2), E_b = 90 deg / (90 deg - alpha)
    curvature = math.sin(beta / 2.0) / (side / 2.0)  # 1 / R
    wheel_ratio = (1.0 + curvature * separation / 2.0) / (1.0 - curvature * separation / 2.0)
    return Umbmark(wheel_ratio, (math.pi / 2.0) / (math.pi / 2.0 - alpha))


def umbmark(squares: Sequence[Square], wheels: WheelParams, sensor: SE2) -> tuple[Umbmark, WheelParams]:
    """Return E_d and E_b relative to `wheels`, and the wheels corrected by them."""
    side = float(np.mean([square.side for square in squares]))
    corrected_wheels = wheels
    for _ in range(ROUNDS):
        errors = return_errors(squares, corrected_wheels, sensor)
        corrected_wheels = umbmark_step(errors, side, corrected_wheels.separation).corrected(corrected_wheels)
    total = Umbmark(
        (corrected_wheels.right / corrected_wheels.left) / (wheels.right / wheels.left),
        corrected_wheels.separation / wheels.separation,
    )
    return total, corrected_wheels
