"""Diagnostics name a cause only where the readings separate it from the others."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from sensor_readings import BODY, PERIOD, filter_readings, simulate_readings, slalom_commands

from chefbot.odometry.diagnostics import diagnostic_message
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.readings import ImuReading, WheelCounts
from chefbot.robot.spec import GRAVITY

Change = Callable[[ImuReading], ImuReading]


def negated(reading: ImuReading) -> ImuReading:
    """Return what a gyro with the wrong sign measures."""
    x, y, z = reading.rates
    return reading._replace(rates=(-x, -y, -z))


def turned_over(reading: ImuReading) -> ImuReading:
    """Return what an IMU measures that is turned by 180 degrees about its x axis."""
    (x, y, z), (ax, ay, az) = reading.rates, reading.force
    return reading._replace(rates=(x, -y, -z), force=(ax, -ay, -az))


@pytest.mark.parametrize(("change", "accused"), [(negated, False), (turned_over, True)])
def test_only_gravity_shows_an_imu_that_is_upside_down(change: Change, accused: bool) -> None:
    """After a bump or a slip the gyro turns against the wheels, too; gravity does not change with that."""
    readings, _ = simulate_readings(slalom_commands(6.0))
    ekf = filter_readings(readings, change)
    sentence = diagnostic_message(ekf, readings[-1].stamp_ns) or ""
    assert "turns against the wheels" in sentence and ("upside down" in sentence) == accused


@pytest.mark.parametrize(
    ("force", "expected"),
    [
        ((0.0, 0.0, GRAVITY), "the gyro's offset has changed"),
        ((0.0, 0.0, 1.2 * GRAVITY), "robot carried"),
        ((2.0, 0.0, GRAVITY), "robot carried"),
    ],
)
def test_a_robot_is_carried_only_if_the_accelerometer_shows_it(
    force: tuple[float, float, float], expected: str
) -> None:
    ekf, variance = Ekf(BODY), (1e-6, 1e-6, 1e-6)
    for k in range(1, 151):
        rate = 0.0 if k < 100 else 0.3
        measured = (0.0, 0.0, GRAVITY) if k < 100 else force
        wiggle = 1e-4 * (k % 7)  # noise: no two readings in a row are equal
        rates, forces = (wiggle, -wiggle, rate + wiggle), (measured[0], measured[1], measured[2] + wiggle)
        ekf.add(ImuReading(k * PERIOD, rates, variance, forces, variance))
        ekf.add(WheelCounts(k * PERIOD, 0, 0))
    sentence = diagnostic_message(ekf, 150 * PERIOD) or ""
    assert expected in sentence and ("carried" in sentence) == ("carried" in expected)
