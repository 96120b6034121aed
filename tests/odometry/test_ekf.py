"""Tests the EKF with late readings, outliers, and sensors that fail, freeze, saturate or are reversed."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_readings import BODY, PERIOD, ROBOT, filter_readings, simulate_readings, slalom_commands

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY
from chefbot.odometry.diagnostics import diagnostic_message
from chefbot.odometry.ekf import HORIZON_NS, Ekf
from chefbot.odometry.readings import UNMEASURED_VARIANCES, ImuReading, WheelCounts, WheelTwist
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.robot.spec import GRAVITY

READINGS, TRUTH = simulate_readings(slalom_commands(12.0))
RECENT = READINGS[300:360]  # shorter than the history, while the robot drives


def attitude(stamp_ns, yaw):
    return ImuReading(
        stamp_ns,
        (0.0,) * 3,
        UNMEASURED_VARIANCES,
        attitude=(0.0, 0.0, yaw),
        attitude_variance=(math.inf, math.inf, 1e-4),
    )


def identical(a, b):
    return a.state.tobytes() == b.state.tobytes() and a.covariance.tobytes() == b.covariance.tobytes()


# -- late readings


@pytest.mark.slow
@settings(max_examples=25)
@given(st.permutations(RECENT), st.integers(0, 59), st.floats(-0.1, 0.1))
def test_arrival_order_does_not_matter_within_the_history(shuffled, k, off):
    match = attitude(RECENT[k].stamp_ns, TRUTH[150 + k // 2].yaw + off)
    assert RECENT[-1].stamp_ns - RECENT[0].stamp_ns < HORIZON_NS
    ordered = filter_readings([*RECENT, match], ekf=filter_readings(READINGS[:300]))
    mixed = filter_readings([match, *shuffled], ekf=filter_readings(READINGS[:300]))
    again = filter_readings(shuffled[:20], ekf=mixed)  # repeated readings have no effect
    assert identical(ordered.belief, mixed.belief) and identical(ordered.belief, again.belief)


def test_a_late_attitude_counts_where_the_robot_was_then():
    match = attitude(READINGS[400].stamp_ns, TRUTH[200].yaw)
    in_time = filter_readings([*READINGS[:401], match, *READINGS[401:440]])
    late = filter_readings([*READINGS[:440], match])
    never = filter_readings(READINGS[:440])
    assert identical(in_time.belief, late.belief) and not identical(late.belief, never.belief)


def test_readings_older_than_the_history_are_rejected():
    ekf = filter_readings(READINGS[:400])
    before = ekf.belief
    assert not ekf.add(READINGS[100])
    assert ekf.too_late == 1 and identical(before, ekf.belief)


def test_a_clock_set_back_does_not_stop_the_filter():
    ekf, hour = filter_readings(READINGS[:400]), 3_600_000_000_000
    rest = [r._replace(stamp_ns=r.stamp_ns - hour) for r in READINGS[400:]]
    end, undisturbed = filter_readings(rest, ekf=ekf).estimate, filter_readings(READINGS).estimate
    assert end.pose.distance(undisturbed.pose) < 0.02
    assert abs(wrap(end.pose.yaw - undisturbed.pose.yaw)) < math.radians(1.0)


@pytest.mark.parametrize("gap_s", [9.0, 11.0])
def test_after_a_long_gap_the_travel_of_the_wheels_is_unknown(gap_s):
    """This holds without an IMU: up to the limit the counts bridge the gap, after it they are a new start."""
    ekf = Ekf(BODY)
    for k in range(3):
        ekf.add(WheelCounts((k + 1) * PERIOD, 0, 0))
    ticks = round(1.0 / ROBOT.metres_per_tick)
    ekf.add(WheelCounts(3 * PERIOD + round(gap_s * 1e9), ticks, ticks))
    bridged = gap_s < 10.0
    assert ekf.estimate.pose.x == pytest.approx(1.0 if bridged else 0.0, abs=1e-3)
    assert (ekf.estimate.covariance[0, 0] > 1.0) != bridged
    ekf.add(WheelCounts(4 * PERIOD + round(gap_s * 1e9), ticks, ticks))
    assert ekf.estimate.pose.x == pytest.approx(1.0 if bridged else 0.0, abs=1e-3)


def test_a_twist_is_not_extrapolated_over_a_long_gap():
    ekf = Ekf(BODY)
    for stamp_ns in (1, PERIOD, PERIOD + 20_000_000_000):
        ekf.add(WheelTwist(stamp_ns, 0.5, 0.0, 1e-4, 1e-4, 1e-6))
    assert ekf.estimate.pose.x < 0.1


# -- the estimate


@settings(max_examples=25)
@given(st.data())
@pytest.mark.slow
def test_covariance_stays_symmetric_and_positive_for_any_input(data):
    rate = st.floats(-6, 6) | st.sampled_from([math.nan, math.inf, 0.0])
    ekf, left, right = Ekf(BODY), 0, 0
    for k in range(1, 30):
        left += data.draw(st.integers(-200, 200))
        right += data.draw(st.integers(-200, 200))
        rates = tuple(data.draw(rate) for _ in range(3))
        force = tuple(data.draw(rate) for _ in range(3))
        ekf.add(ImuReading(k * PERIOD, rates, (1e-6,) * 3, force, (1e-3,) * 3))
        ekf.add(WheelCounts(k * PERIOD, left, right))
        if data.draw(st.booleans()):
            ekf.add(attitude(k * PERIOD, data.draw(st.floats(-1, 1))))
    matrix = ekf.belief.covariance
    assert np.isfinite(ekf.belief.state).all()
    assert np.array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() > -1e-12 * np.linalg.eigvalsh(matrix).max()


def test_heading_drift_stops_at_standstill():
    """The biases of all axes are estimated; without that, 1 deg/s would rotate the pose by 60 deg in a minute."""
    bias = np.radians([0.5, -0.7, 1.0])
    readings, _ = simulate_readings([(0.0, 0.0)] * 3000)
    noise, half = np.random.default_rng(4), None
    ekf = Ekf(BODY)
    for reading in readings:
        if isinstance(reading, ImuReading):
            rates = bias + ROBOT.sensors.imu.gyro_noise * noise.normal(size=3)
            reading = reading._replace(rates=tuple(rates.tolist()))
        ekf.add(reading)
        half = ekf.estimate if reading.stamp_ns == 1500 * PERIOD else half
    end = ekf.estimate
    assert np.allclose(ekf.belief.state[13:16], bias, atol=2e-4)
    assert abs(end.pose.yaw - half.pose.yaw) < math.radians(0.001)
    assert abs(end.pose.yaw) < math.radians(0.1)
    assert max(abs(end.roll), abs(end.pitch)) < math.radians(0.5)


def test_on_a_ramp_the_horizontal_distance_is_shorter():
    slope, readings = math.radians(-5.0), simulate_readings([(0.0, 0.0)] * 100 + [(0.3, 0.0)] * 500)[0]
    step, ekf = 0, Ekf(BODY)
    for reading in readings:
        if isinstance(reading, ImuReading):
            step += 1
            tilting = 200 <= step < 250  # within this second it drives onto the ramp
            up = slope * min(max(step - 200, 0), 50) / 50
            rates = (reading.rates[0], reading.rates[1] + slope * tilting, reading.rates[2])
            force = (reading.force[0] - GRAVITY * math.sin(up), reading.force[1], reading.force[2])
            reading = reading._replace(rates=rates, force=force)
        ekf.add(reading)
    on_ramp = 0.3 * 0.02 * (600 - 225)
    assert ekf.estimate.height == pytest.approx(-on_ramp * math.sin(slope), rel=0.15)
    assert ekf.estimate.pitch == pytest.approx(slope, abs=math.radians(0.8))


@pytest.mark.slow
def test_late_attitudes_correct_the_drift_of_the_heading():
    readings, truth = simulate_readings(slalom_commands(40.0))
    ekf, rng = Ekf(BODY), np.random.default_rng(3)
    for reading in readings:
        ekf.add(reading)
        k = reading.stamp_ns // PERIOD
        if isinstance(reading, WheelCounts) and k % 5 == 0 and k > 60:
            yaw = truth[k - 11].yaw + 0.01 * rng.normal()
            ekf.add(attitude((k - 10) * PERIOD, yaw))  # late by 0.2 s
    alone = filter_readings(readings)
    assert abs(wrap(ekf.estimate.pose.yaw - truth[-1].yaw)) < math.radians(1.0)
    assert ekf.estimate.covariance[2, 2] < 0.5 * alone.estimate.covariance[2, 2]
    assert ekf.condition(Source.ATTITUDE, readings[-1].stamp_ns) is Condition.LATE


# -- outliers


@pytest.mark.parametrize("spike", [3.0, -2.0, 0.6])
def test_one_gyro_spike_does_not_turn_the_robot(spike):
    def damaged(reading):
        x, y, z = reading.rates
        hit = reading.stamp_ns == 400 * PERIOD
        return reading._replace(rates=(x, y, z + spike)) if hit else reading

    clean, hit = filter_readings(READINGS), filter_readings(READINGS, damaged)
    assert hit.belief.monitors[Source.GYRO].refused == 1
    # one step by the wheels alone, whose slip is 0.06 deg (one sigma); the spike itself would be 0.6 deg or more
    assert abs(wrap(hit.estimate.pose.yaw - clean.estimate.pose.yaw)) < math.radians(0.2)
    assert hit.estimate.pose.distance(clean.estimate.pose) < 5e-3


CONTACT_RATES = (
    *(0.19, 0.52, 1.06, 1.30, 1.36, 1.32, 1.21, 0.98, 0.64, 0.58, 0.70, 0.81, 0.54, 0.66),
    *(0.47, 0.81, 0.43, 0.27, 0.67, 0.18, 0.13, 0.59, 0.89, 1.01, 0.19),
)
"""Yaw rates that a person who walked into a moving robot added to those of its wheels, rad/s at 50 Hz."""


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("start", range(200, 600, 45))
def test_a_contact_turns_the_heading_by_what_the_gyro_measures(start, sign):
    """Real rates jump by more than a damaged reading's limit, and oppose those of the wheels for a few readings."""

    def hit(reading):
        k = reading.stamp_ns // PERIOD - start
        x, y, z = reading.rates
        return reading._replace(rates=(x, y, z + sign * CONTACT_RATES[k])) if 0 <= k < 25 else reading

    turned = sign * sum(CONTACT_RATES) * PERIOD * 1e-9
    clean, pushed = filter_readings(READINGS), filter_readings(READINGS, hit)
    assert abs(wrap(pushed.estimate.pose.yaw - clean.estimate.pose.yaw - turned)) < math.radians(1.5)
    assert pushed.condition(Source.GYRO, READINGS[-1].stamp_ns) is Condition.FRESH


def test_an_outlier_of_attitude_or_accelerometer_moves_nothing():
    ekf = filter_readings(READINGS[:400])
    before, stamp = ekf.belief, READINGS[399].stamp_ns
    ekf.add(attitude(stamp, ekf.estimate.pose.yaw + 1.0))
    assert identical(before, ekf.belief) and ekf.belief.monitors[Source.ATTITUDE].refused == 1

    def hit(reading):
        return reading._replace(force=(9.0, 0.0, GRAVITY)) if reading.stamp_ns == 400 * PERIOD else reading

    assert (
        filter_readings(READINGS, hit).estimate.pose.distance(filter_readings(READINGS).estimate.pose) < 1e-4
    )


def test_a_persistent_attitude_is_used_after_some_rejections():
    ekf = Ekf(BODY)
    for reading in READINGS:
        ekf.add(reading)
        k = reading.stamp_ns // PERIOD
        if isinstance(reading, WheelCounts) and k > 200 and k % 10 == 0:
            ekf.add(attitude(reading.stamp_ns, TRUTH[k - 1].yaw + 1.0))
    assert abs(wrap(ekf.estimate.pose.yaw - TRUTH[-1].yaw - 1.0)) < 0.05


# -- sensors that fail


def run_with_failure(change, since=300):
    """Return yaw error, filter with a failure from step `since` on, and filter without it."""

    def after(reading):
        return change(reading) if reading.stamp_ns > since * PERIOD else reading

    ekf = filter_readings(READINGS, after)
    return abs(wrap(ekf.estimate.pose.yaw - TRUTH[-1].yaw)), ekf, filter_readings(READINGS)


def stuck_at(k):
    rates = READINGS[2 * k].rates
    return lambda reading: reading._replace(rates=rates)


FAILURES = {
    "silent": (lambda _: None, Condition.LOST),
    "frozen while turning": (stuck_at(300), Condition.STUCK),
    "frozen at zero": (lambda r: r._replace(rates=(0.0, 0.0, 0.0)), Condition.STUCK),
    "saturated": (lambda r: r._replace(rates=(0.0, 0.0, BODY.gyro_range)), Condition.SATURATED),
    "reversed": (lambda r: r._replace(rates=tuple(-rate for rate in r.rates)), Condition.REVERSED),
}


@pytest.mark.parametrize("name", FAILURES)
def test_a_failed_gyro_is_reported_and_ignored(name):
    """The wheels continue: in 9.5 s their error of 0.3 % gives some 2 deg, and 0.5 rad/s would give 270 deg."""
    change, condition = FAILURES[name]
    error, ekf, healthy = run_with_failure(change)
    now = READINGS[-1].stamp_ns
    assert ekf.condition(Source.GYRO, now) is condition
    assert healthy.condition(Source.GYRO, now) is Condition.FRESH and diagnostic_message(healthy, now) is None
    assert error < math.radians(6.0)
    assert ekf.estimate.covariance[2, 2] > 2.0 * healthy.estimate.covariance[2, 2]
    assert "gyro" in (diagnostic_message(ekf, now) or "")


@pytest.mark.parametrize("name", ["frozen while turning", "frozen at zero", "saturated", "silent"])
def test_a_failing_gyro_causes_no_turn_before_detection(name):
    """The heading stays within a degree of that of a filter without the failure."""
    change, _ = FAILURES[name]
    failed, healthy = Ekf(BODY), Ekf(BODY)
    for reading in READINGS[:640]:
        broken = isinstance(reading, ImuReading) and reading.stamp_ns > 300 * PERIOD
        received = change(reading) if broken else reading
        if received is not None:
            failed.add(received)
        healthy.add(reading)
        assert abs(wrap(failed.estimate.pose.yaw - healthy.estimate.pose.yaw)) < math.radians(1.0)


def test_a_recovered_gyro_is_used_again():
    frozen = stuck_at(300)

    def repaired(reading):
        return frozen(reading) if 300 * PERIOD < reading.stamp_ns < 400 * PERIOD else reading

    ekf = filter_readings(READINGS, repaired)
    assert ekf.condition(Source.GYRO, READINGS[-1].stamp_ns) is Condition.FRESH
    assert ekf.time_since_used(Source.GYRO, READINGS[-1].stamp_ns) == 0.0


def test_without_wheels_the_estimate_degrades_with_a_diagnostic():
    ekf = filter_readings(READINGS[:600])
    last = READINGS[599].stamp_ns
    for reading in READINGS[600:]:
        if isinstance(reading, ImuReading):
            ekf.add(reading)
    assert ekf.condition(Source.WHEELS, last + 200_000_000) is Condition.FRESH
    assert ekf.condition(Source.WHEELS, last + 400_000_000) is Condition.LOST
    assert "No wheels for 1.0 s" in (diagnostic_message(ekf, last + 1_000_000_000) or "")
    here, soon, later = (ekf.at(last + s * 1_000_000_000) for s in (0, 1, 3))
    assert later.pose.distance(here.pose) < 1e-3 and abs(later.v) < 1e-3
    assert here.covariance[0, 0] < soon.covariance[0, 0] < later.covariance[0, 0]
    assert later.covariance[0, 0] > 0.1  # three seconds at full speed may be a metre


def test_returning_encoder_counts_recover_the_missed_motion():
    gap = [r for r in READINGS if not (isinstance(r, WheelCounts) and 300 < r.stamp_ns // PERIOD <= 450)]
    ekf = filter_readings(gap)
    assert ekf.estimate.pose.distance(TRUTH[-1]) < 0.1  # of 0.9 m on a slalom without wheels
    assert abs(wrap(ekf.estimate.pose.yaw - TRUTH[-1].yaw)) < math.radians(1.0)


def test_after_a_long_silence_only_the_gyro_constrains_yaw():
    readings, truth = simulate_readings(slalom_commands(25.0))
    gap = [r for r in readings if not (isinstance(r, WheelCounts) and 300 < r.stamp_ns // PERIOD <= 1000)]
    ekf = filter_readings(gap)
    off = np.array(ekf.estimate.pose[:2]) - np.array(truth[-1][:2])
    assert abs(wrap(ekf.estimate.pose.yaw - truth[-1].yaw)) < math.radians(2.0)
    assert off @ np.linalg.solve(ekf.estimate.covariance[:2, :2], off) < 9.2  # 99 % of chi-squared


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_dead_encoder_is_reported_and_inflates_covariance(side):
    straight = simulate_readings([(0.0, 0.0)] * 50 + [(0.3, 0.0)] * 400)[0]
    last = next(r for r in straight if isinstance(r, WheelCounts) and r.stamp_ns == 200 * PERIOD)

    def dead(reading):
        broken = isinstance(reading, WheelCounts) and reading.stamp_ns > 200 * PERIOD
        return reading._replace(**{side: getattr(last, side)}) if broken else reading

    ekf, reported = Ekf(BODY), None
    for reading in map(dead, straight):
        ekf.add(reading)
        sentence = diagnostic_message(ekf, reading.stamp_ns) or ""
        if f"The {side} wheel counts nothing" in sentence and reported is None:
            reported = reading.stamp_ns
    assert reported is not None and reported - 200 * PERIOD <= 300_000_000
    missed = 0.3 * 0.02 * 250
    assert abs(ekf.estimate.pose.yaw) < math.radians(3.0)
    assert abs(ekf.estimate.pose.x - 0.3 * 0.02 * 400) < 2.0 * math.sqrt(ekf.estimate.covariance[0, 0])
    assert math.sqrt(ekf.estimate.covariance[0, 0]) == pytest.approx(0.5 * missed, rel=0.2)


def test_a_stuck_accelerometer_is_excluded():
    force = READINGS[600].force

    def frozen(reading):
        return reading._replace(force=force) if reading.stamp_ns > 300 * PERIOD else reading

    stopping, _ = simulate_readings(slalom_commands(8.0) + [(0.0, 0.0)] * 40)
    ekf = filter_readings(stopping, frozen)
    assert ekf.condition(Source.ACCELEROMETER, stopping[-1].stamp_ns) is Condition.STUCK
    assert "accelerometer" in (diagnostic_message(ekf, stopping[-1].stamp_ns) or "")


def test_no_fault_is_reported_before_the_first_reading():
    ekf = Ekf(BODY)
    assert ekf.estimate.pose == IDENTITY and diagnostic_message(ekf, 10**10) is None
    assert ekf.condition(Source.WHEELS, 0) is Condition.ABSENT
    ekf.add(WheelCounts(PERIOD, 5, 5))
    assert "No gyro so far" in (diagnostic_message(ekf, PERIOD) or "")
