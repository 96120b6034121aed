"""Simulates the stamped readings of a drive and filters them, with changes if wanted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from imperfect_robot import RATE, Faults, drive, hotel_drive

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


def simulate_readings(
    commands: list[tuple[float, float]], seed: int = 1, faults: Faults | None = None
) -> tuple[list[Reading], list[SE2]]:
    """Return the readings of IMU and wheels in order, and the true pose after each step of (v, w) commands."""
    rng, imu = np.random.default_rng(seed), ROBOT.sensors.imu
    readings: list[Reading] = []
    truth, before = [], 0.0
    pairs = zip([(0.0, 0.0), *commands], drive(ROBOT, commands, faults or Faults(), rng), strict=True)
    for k, ((v, w), reading) in enumerate(pairs):
        stamp = (k + 1) * PERIOD
        rates = (*(imu.gyro_noise * rng.normal(size=2)).tolist(), reading.gyro_z)
        acceleration, before = (v - before) * RATE, v
        force = np.array([acceleration, v * w, GRAVITY]) - w * w * np.array([imu.mount.x, imu.mount.y, 0.0])
        force += imu.accelerometer_noise * rng.normal(size=3)
        variances = (imu.gyro_noise**2,) * 3, (imu.accelerometer_noise**2,) * 3
        x, y, z = force.tolist()
        readings.append(ImuReading(stamp, rates, variances[0], (x, y, z), variances[1]))
        readings.append(WheelCounts(stamp, reading.left, reading.right))
        truth.append(reading.truth)
    return readings, truth


def slalom_commands(seconds: float, v: float = 0.3) -> list[tuple[float, float]]:
    """Return commands for standstill of a second and then a slalom."""
    times = np.arange(round(seconds * RATE)) / RATE
    return [(0.0, 0.0)] * round(RATE) + [(v, float(0.5 * np.sin(1.5 * t))) for t in times]


def filter_readings(readings: list[Reading], change: Change | None = None, ekf: Ekf | None = None) -> Ekf:
    """Return a filter after all readings; `change` modifies those of the IMU, or drops them by returning None."""
    ekf = ekf or Ekf(BODY)
    for reading in readings:
        received = change(reading) if change and isinstance(reading, ImuReading) else reading
        if received is not None:
            ekf.add(received)
    return ekf


__all__ = [
    "BODY",
    "PERIOD",
    "ROBOT",
    "Faults",
    "filter_readings",
    "hotel_drive",
    "simulate_readings",
    "slalom_commands",
]
