"""UMBmark: systematic errors of two wheels from squares driven both ways.

Borenstein & Feng, Measurement and correction of systematic odometry errors in mobile robots, IEEE Transactions on
Robotics and Automation 12 (6), 1996. A wrong separation bends the corners and a difference of the wheels the sides;
squares to the left and to the right tell the two apart. The mean diameter they do not show.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.drive import Square
from chefbot.calibration.wheels import Wheels, travelled
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2

ROUNDS = 12
"""The paper's formulas are linear in the errors; done again with the corrected numbers they become exact."""


class ReturnErrors(NamedTuple):
    """Where the robot was at the end of its squares, seen from where its wheels said it was: (n, 2) m each.

    Axes: x along the first side, y along the last one, into the square: as the paper has them.
    """

    left: NDArray[np.float64]
    right: NDArray[np.float64]

    @property
    def worst(self) -> float:
        """E_max,syst: the further of the two clusters' centres of gravity, m (the paper's equation 3)."""
        return max(math.hypot(*self.left.mean(axis=0)), math.hypot(*self.right.mean(axis=0)))


def return_errors(squares: Sequence[Square], wheels: Wheels, sensor: SE2) -> ReturnErrors:
    """True minus calculated place at the end of each run, in the frame of its start.

    sensor: where the sensor is that saw the walls. UserError unless both ways were driven.
    """
    found: dict[int, list[tuple[float, float]]] = {1: [], -1: []}
    for square in squares:
        truth = sensor @ square.seen @ sensor.inverse()
        told = travelled(square.ticks, wheels)
        found[square.turn].append((truth.x - told.x, truth.y - told.y))
    if not (found[1] and found[-1]):
        raise UserError("UMBmark needs a square to the left and one to the right; let the robot drive both")
    return ReturnErrors(np.array(found[1]), np.array(found[-1]))


class Umbmark(NamedTuple):
    """wheel_ratio: E_d, right diameter by left one. separation_ratio: E_b, true separation by the assumed one."""

    wheel_ratio: float
    separation_ratio: float

    def corrected(self, wheels: Wheels) -> Wheels:
        """With the same mean diameter (the paper's equations 16 and 20)."""
        left, right = 2.0 / (self.wheel_ratio + 1.0), 2.0 / (1.0 / self.wheel_ratio + 1.0)
        return Wheels(wheels.left * left, wheels.right * right, wheels.separation * self.separation_ratio)


def step(errors: ReturnErrors, side: float, separation: float) -> Umbmark:
    """E_d and E_b by the paper's formulas, from the centres of gravity along x.

    alpha bends each corner (type A), beta each side (type B); the side is an arc of radius R. Where the paper takes
    the robot's own separation for b, so does this.
    """
    x_left, x_right = float(errors.left[:, 0].mean()), float(errors.right[:, 0].mean())
    alpha, beta = (x_right + x_left) / (-4.0 * side), (x_right - x_left) / (-4.0 * side)
    if abs(alpha) > 0.4 or abs(beta) > 0.8:
        raise UserError(
            f"the squares end {max(abs(x_left), abs(x_right)):.2f} m from where the wheels say, too far for a square "
            f"of {side:.1f} m; look at wheels.diameter and wheels.separation in the robot file"
        )
    half_sine = math.sin(beta / 2.0) / (side / 2.0)  # 1 / R
    wheel_ratio = (1.0 + half_sine * separation / 2.0) / (1.0 - half_sine * separation / 2.0)
    return Umbmark(wheel_ratio, (math.pi / 2.0) / (math.pi / 2.0 - alpha))


def umbmark(squares: Sequence[Square], wheels: Wheels, sensor: SE2) -> tuple[Umbmark, Wheels]:
    """E_d and E_b against `wheels`, and the wheels corrected by them."""
    side = float(np.mean([square.side for square in squares]))
    better = wheels
    for _ in range(ROUNDS):
        errors = return_errors(squares, better, sensor)
        better = step(errors, side, better.separation).corrected(better)
    total = Umbmark(
        (better.right / better.left) / (wheels.right / wheels.left), better.separation / wheels.separation
    )
    return total, better
