"""The readings of a whole drive, stamped; and what one can do to them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from faulty_drive import RATE, Faults, drive, hotel_round

from chefbot.maths.se2 import SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import ImuReading, Reading, WheelCounts
from chefbot.robot.load import load_robot
from chefbot.robot.spec import GRAVITY

ROBOT = load_robot("chefbot")
BODY = DriveModel.of(ROBOT, OdometryParams())
PERIOD = round(1e9 / RATE)
Change = Callable[[ImuReading], ImuReading | None]


def sensed(
    commands: list[tuple[float, float]], seed: int = 1, faults: Faults | None = None
) -> tuple[list[Reading], list[SE2]]:
    """IMU and wheels of every step, in order, and the true pose after each; (v, w) commands as in `drive`."""
    rng, imu = np.random.default_rng(seed), ROBOT.sensors.imu
    readings: list[Reading] = []
    truth, before = [], 0.0
    pairs = zip([(0.0, 0.0), *commands], drive(ROBOT, commands, faults or Faults(), rng), strict=True)
    for k, ((v, w), told) in enumerate(pairs):
        stamp = (k + 1) * PERIOD
        rates = (*(imu.gyro_noise * rng.normal(size=2)).tolist(), told.gyro_z)
        gathers, before = (v - before) * RATE, v
        force = np.array([gathers, v * w, GRAVITY]) - w * w * np.array([imu.mount.x, imu.mount.y, 0.0])
        force += imu.accelerometer_noise * rng.normal(size=3)
        variances = (imu.gyro_noise**2,) * 3, (imu.accelerometer_noise**2,) * 3
        x, y, z = force.tolist()
        readings.append(ImuReading(stamp, rates, variances[0], (x, y, z), variances[1]))
        readings.append(WheelCounts(stamp, told.left, told.right))
        truth.append(told.truth)
    return readings, truth


def weave(seconds: float, v: float = 0.3) -> list[tuple[float, float]]:
    """Stand for a second, then wind along."""
    times = np.arange(round(seconds * RATE)) / RATE
    return [(0.0, 0.0)] * round(RATE) + [(v, float(0.5 * np.sin(1.5 * t))) for t in times]


def through(readings: list[Reading], change: Change | None = None, ekf: Ekf | None = None) -> Ekf:
    """A filter that heard them all, those of the IMU as `change` makes them; None is silence."""
    ekf = ekf or Ekf(BODY)
    for reading in readings:
        heard = change(reading) if change and isinstance(reading, ImuReading) else reading
        if heard is not None:
            ekf.add(heard)
    return ekf


__all__ = ["BODY", "PERIOD", "ROBOT", "Faults", "hotel_round", "sensed", "through", "weave"]
