"""Scale and offset of the gyro from turns whose angle the scans saw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.drive import Leg
from chefbot.errors import UserError
from chefbot.maths.angles import wrap

LEAST_TURNED = 4.0 * math.pi
"""rad, left and right, without which the scale says nothing."""
FURTHEST_SCALE = 0.25
OUTLIER = 4.5
LEAST_NOISE = 1e-4  # rad


class GyroSolution(NamedTuple):
    """scale: what the gyro tells of a turn of 1. offset: rad/s. deviations: standard deviations of both."""

    scale: float
    offset: float
    deviations: tuple[float, float]


def solve_gyro(legs: Sequence[Leg]) -> GyroSolution:
    """gyro = scale * turn + offset * seconds, by least squares; drives that fit badly are left out.

    UserError if the robot hardly turned, or if the gyro does not tell its turns.
    """
    told = np.array([leg.gyro for leg in legs])
    # scans do not count whole turns; the gyro does, long before it is calibrated
    turned = np.array([leg.gyro + wrap(leg.seen.yaw - leg.gyro) for leg in legs])
    if np.abs(turned).sum() < LEAST_TURNED:
        raise UserError(
            f"the robot turned {math.degrees(np.abs(turned).sum()):.0f} degrees by the gyro, too little to "
            "calibrate it; is it alive and upright?"
        )
    A = np.column_stack([turned, [leg.seconds for leg in legs]])
    kept = np.ones(len(legs), np.bool_)
    for _ in range(5):
        found, noise = _fit(A[kept], told[kept])
        kept = np.abs(told - A @ found) <= OUTLIER * noise
    if abs(found[0] - 1.0) > FURTHEST_SCALE:
        raise UserError(
            f"the gyro tells {found[0]:.2f} of a turn of 1; it is dead, tilted, or not the firmware's chip"
        )
    deviations = noise * np.sqrt(np.linalg.inv(A[kept].T @ A[kept]).diagonal())
    return GyroSolution(float(found[0]), float(found[1]), (float(deviations[0]), float(deviations[1])))


def _fit(A: NDArray[np.float64], told: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    found, *_ = np.linalg.lstsq(A, told, rcond=None)
    residuals = told - A @ found
    return np.asarray(found, np.float64), max(
        float(np.sqrt(residuals @ residuals / max(len(told) - 2, 1))), LEAST_NOISE
    )
