"""Tests the consistency of the filter's covariance and the benefit of a gyro."""

import math

import numpy as np
import pytest
from imperfect_robot import RATE, Faults, drive, hotel_drive
from synchronous import SynchronousEkf

from chefbot.maths.angles import wrap
from chefbot.odometry.params import OdometryParams
from chefbot.robot.load import load_robot

DT = 1.0 / RATE
ROBOT = load_robot("chefbot")


def error(truth, pose):
    return np.array([pose.x - truth.x, pose.y - truth.y, wrap(pose.yaw - truth.yaw)])


def nees(truth, estimate):
    e = error(truth, estimate.pose)
    return float(e @ np.linalg.solve(estimate.covariance, e))


def noisy_gyro(rate):
    """Yield readings of a gyro with noise, so that they are not constant."""
    rng = np.random.default_rng(8)
    while True:
        yield rate + ROBOT.sensors.imu.gyro_noise * rng.normal()


def run(seed, commands, faults, with_gyro):
    params = OdometryParams(slip=faults.slip, diameter_error=faults.diameter)
    odometry = SynchronousEkf(ROBOT, params)
    for reading in drive(ROBOT, commands, faults, np.random.default_rng(seed)):
        gyro = reading.gyro_z if with_gyro else None
        estimate = odometry.update(reading.left, reading.right, DT, gyro)
    return odometry, reading.truth, estimate


@pytest.mark.rotated("consistency of the odometry's covariance")
@pytest.mark.slow
@pytest.mark.parametrize(("metres", "diameter", "slip"), [(2.0, 0.003, 0.003), (8.0, 0.0005, 0.006)])
def test_covariance_from_wheels_is_consistent(metres, diameter, slip):
    """The mean NEES of 150 runs is within 4 sigma of the 3 of the chi-squared distribution.

    In one case the errors of the diameters dominate, in the other slip.
    """
    commands, faults = hotel_drive(stand=0.5, metres=metres), Faults(diameter=diameter, slip=slip)
    mean = np.mean([nees(*run(seed, commands, faults, False)[1:]) for seed in range(150)])
    assert abs(mean - 3.0) < 4.0 * math.sqrt(6.0 / 150)


@pytest.mark.rotated("consistency of the odometry's covariance")
@pytest.mark.slow
def test_covariance_with_gyro_is_consistent():
    """The filter may be somewhat conservative, as the simulated bias has no random walk."""
    commands = hotel_drive(metres=8.0)
    faults = Faults(gyro_gain=0.003)
    mean = np.mean([nees(*run(seed, commands, faults, True)[1:]) for seed in range(60)])
    assert 1.5 < mean < 3.0 + 4.0 * math.sqrt(6.0 / 60)


@pytest.mark.rotated("consistency of the odometry's covariance")
@pytest.mark.slow
def test_a_gyro_improves_the_heading_several_times():
    commands = hotel_drive(metres=20.0)
    yaw = {}
    for with_gyro in (False, True):
        results = [run(seed, commands, Faults(gyro_gain=0.003), with_gyro) for seed in range(8)]
        yaw[with_gyro] = np.sqrt(np.mean([error(truth, est.pose)[2] ** 2 for _, truth, est in results]))
    assert yaw[True] < yaw[False] / 5.0


def test_gyro_bias_is_estimated_at_standstill():
    bias, rng = 0.02, np.random.default_rng(5)  # several times the standard deviation in the robot file
    ekf = SynchronousEkf(ROBOT)
    for _ in range(500):
        estimate = ekf.update(0, 0, DT, bias + ROBOT.sensors.imu.gyro_noise * rng.normal())
    found, deviation = ekf.gyro_bias
    assert abs(found - bias) < 4.0 * deviation < 1e-3
    assert abs(estimate.pose.yaw) < math.radians(0.05)


def test_a_wrong_wheel_diameter_is_estimated_from_the_gyro():
    """Only the difference of the diameters is observable, which the covariance has to show."""
    commands, true_right = hotel_drive(metres=15.0), 1.006
    ekf, rolled, rng = SynchronousEkf(ROBOT), np.zeros(2), np.random.default_rng(2)
    base = ROBOT.wheels.separation
    ekf.update(0, 0, DT, 0.0)
    for v, w in commands:
        rolled += DT * np.array([v - 0.5 * w * base, (v + 0.5 * w * base) / true_right])
        left, right = np.floor(rolled / ROBOT.metres_per_tick)
        ekf.update(int(left), int(right), DT, w + ROBOT.sensors.imu.gyro_noise * rng.normal())
    shares, covariance = ekf.calibration
    assert shares[1] - shares[0] == pytest.approx(0.006, abs=0.001)
    assert covariance[0, 0] + covariance[1, 1] > covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]


def test_without_gyro_the_covariance_grows_and_is_reported():
    commands = hotel_drive(metres=10.0)
    readings = list(drive(ROBOT, commands, Faults(), np.random.default_rng(1)))
    steady, dropped = SynchronousEkf(ROBOT), SynchronousEkf(ROBOT)
    for k, r in enumerate(readings):
        with_gyro = steady.update(r.left, r.right, DT, r.gyro_z)
        without = dropped.update(r.left, r.right, DT, r.gyro_z if k < 400 else None)
    assert steady.gyro_age == 0.0
    assert dropped.gyro_age == pytest.approx((len(readings) - 400) * DT)
    assert without.covariance[2, 2] > 4.0 * with_gyro.covariance[2, 2]
    assert nees(r.truth, without) < 16.3  # 99.9 % of chi-squared with 3 degrees of freedom


def test_a_slipping_wheel_does_not_turn_the_heading():
    ekf, wheels = SynchronousEkf(ROBOT), SynchronousEkf(ROBOT)
    left = right = 0
    slipped, gyro = 0, noisy_gyro(0.001)
    for k in range(600):
        spinning = 300 <= k < 330
        moving = k >= 100
        left, right = left + 90 * moving, right + (150 if spinning else 90) * moving
        fused, counted = ekf.update(left, right, DT, next(gyro)), wheels.update(left, right, DT)
        slipped += ekf.slipping
    by_counts = 60 * 30 * ROBOT.metres_per_tick / ROBOT.wheels.separation
    assert counted.pose.yaw == pytest.approx(by_counts, rel=0.05) and by_counts > 0.2
    assert abs(fused.pose.yaw) < 0.03
    assert slipped >= 25


@pytest.mark.parametrize("damage", [math.nan, math.inf, -1e9, 60.0])
def test_an_invalid_reading_is_skipped(damage):
    ekf = SynchronousEkf(ROBOT)
    for k in range(50):
        before = ekf.update(80 * k, 80 * k, DT, 0.0)
    after = ekf.update(80 * 50, 80 * 50, DT, damage)
    assert ekf.gyro.refused == 1 and ekf.gyro_age > 0.0
    assert abs(after.pose.yaw - before.pose.yaw) < 1e-3
    ekf.update(80 * 51, 80 * 51, DT, 0.0)
    assert ekf.gyro_age == 0.0


def test_the_yaw_of_a_carried_robot_follows_the_gyro():
    ekf, still, turning = SynchronousEkf(ROBOT), noisy_gyro(0.0), noisy_gyro(1.0)
    for _ in range(100):
        ekf.update(0, 0, DT, next(still))
    for _ in range(50):
        estimate = ekf.update(0, 0, DT, next(turning))
    assert ekf.slipping
    assert estimate.pose.yaw == pytest.approx(1.0, abs=0.01)


@pytest.mark.rotated("consistency of the odometry's covariance")
@pytest.mark.slow
def test_covariance_stays_positive_semidefinite_over_an_hour():
    ekf, rng, left, right = SynchronousEkf(ROBOT), np.random.default_rng(3), 0, 0
    for k in range(60_000):
        if (k // 1000) % 3:
            left, right = left + int(rng.integers(60, 100)), right + int(rng.integers(60, 100))
        estimate = ekf.update(left, right, 0.06, float(rng.normal(0.0, 0.01)))
    for matrix in (estimate.covariance, estimate.twist_covariance, ekf.calibration[1]):
        assert np.array_equal(matrix, matrix.T)
        assert np.linalg.eigvalsh(matrix).min() > -1e-12


def test_motion_at_the_first_call_is_not_taken_for_bias():
    ekf = SynchronousEkf(ROBOT)
    ekf.update(12345, 54321, DT, 0.7)
    assert ekf.gyro_bias[0] == 0.0


def test_the_same_readings_give_identical_bytes():
    commands = hotel_drive(metres=3.0)
    first, second = (run(9, commands, Faults(), True)[2] for _ in range(2))
    assert first.pose == second.pose
    assert first.covariance.tobytes() == second.covariance.tobytes()
