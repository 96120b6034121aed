"""Calibration of the gyro's scale and bias against rotations measured by scan matching."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.drive import DriveSegment
from chefbot.calibration.errors import CalibrationError
from chefbot.maths.angles import wrap

MIN_ROTATION = 4.0 * math.pi
"""Minimum rotation, left and right added, for the scale to be observable, rad."""
MAX_SCALE_ERROR = 0.25
OUTLIER = 4.5
MIN_NOISE = 1e-4  # rad


class GyroSolution(NamedTuple):
    """The calibrated gyro: scale (measured by true angle), offset (bias, rad/s), and standard deviations of
    both."""

    scale: float
    offset: float
    deviations: tuple[float, float]


def solve_gyro(legs: Sequence[DriveSegment]) -> GyroSolution:
    """Fit gyro = scale * rotation + offset * seconds by least squares, with outliers removed.

    Raise CalibrationError if the robot turned too little, or if the gyro does not measure its rotations.
    """
    measured = np.array([leg.gyro for leg in legs])
    # Scan matching gives the angle modulo 2 pi; the uncalibrated gyro resolves the full turns
    rotations = np.array([leg.gyro + wrap(leg.seen.yaw - leg.gyro) for leg in legs])
    _check_turned(rotations)
    # Design matrix of the linear model
    A = np.column_stack([rotations, [leg.seconds for leg in legs]])
    inliers = np.ones(len(legs), np.bool_)
    # Iterated least squares without outliers
    for _ in range(5):
        solution, noise = _fit(A[inliers], measured[inliers])
        inliers = np.abs(measured - A @ solution) <= OUTLIER * noise
    if abs(solution[0] - 1.0) > MAX_SCALE_ERROR:
        raise CalibrationError(
            f"the gyro scale is {solution[0]:.2f}; the gyro is dead, tilted, or not the firmware's chip"
        )
    # Covariance sigma^2 (A^T A)^-1
    deviations = noise * np.sqrt(np.linalg.inv(A[inliers].T @ A[inliers]).diagonal())
    return GyroSolution(float(solution[0]), float(solution[1]), (float(deviations[0]), float(deviations[1])))


def _check_turned(rotations: NDArray[np.float64]) -> None:
    if np.abs(rotations).sum() < MIN_ROTATION:
        raise CalibrationError(
            f"the robot turned {math.degrees(np.abs(rotations).sum()):.0f} degrees by the gyro, too little to "
            "calibrate it; is it alive and upright?"
        )


def _fit(A: NDArray[np.float64], measured: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    solution, *_ = np.linalg.lstsq(A, measured, rcond=None)
    residuals = measured - A @ solution
    return np.asarray(solution, np.float64), max(
        float(np.sqrt(residuals @ residuals / max(len(measured) - 2, 1))), MIN_NOISE
    )
