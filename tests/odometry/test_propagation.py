"""Tests propagation between two wheel readings and the measurement updates within it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.errors import OdometryError
from chefbot.maths.se2 import SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.estimate import estimate_of
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.fusion import BRIDGE_NS, _propagate, predict_without_wheels, process_reading
from chefbot.odometry.gyro import update_gyro
from chefbot.odometry.measurement_updates import GRAVITY, update_imu
from chefbot.odometry.motion_model import DELTA_S, DELTA_YAW, PITCH, SIZE, YAW, X, Y
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.propagation import (
    PropagationInterval,
    add_heading,
    begin_interval,
    inflate_heading,
    move_to,
    selection_jacobian,
    slip,
)
from chefbot.odometry.readings import IMU, ImuReading, WheelCounts
from chefbot.odometry.sensor_health import (
    ACCELEROMETER,
    FAULTS,
    GYRO,
    Condition,
    Record,
    new_monitors,
    note_reading,
)
from chefbot.odometry.wheel_travel import EncoderState, WheelTravel
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
MODEL = DriveModel.of(ROBOT, OdometryParams())
STEP_NS = 20_000_000
TRAVEL = st.floats(-0.02, 0.02)


def belief_at(stamp_ns: int = 0) -> FilterState:
    return FilterState.initial(MODEL)._replace(stamp_ns=stamp_ns)


def interval_of(left: float, right: float, standing: bool = False, **memory: Any) -> PropagationInterval:
    rolled, start = WheelTravel(left, right, 1e-8, 1e-8), belief_at()
    for name, value in memory.items():
        start.memory[name] = value
    arrays = start.state, start.covariance, start.monitor_records, start.memory
    return begin_interval(*arrays, MODEL.parameters, rolled, 0, STEP_NS, standing)


def imu(stamp_ns: int, rate: float = 0.0, force: tuple[float, float, float] | None = None) -> ImuReading:
    variance = (ROBOT.sensors.imu.gyro_noise**2,) * 3
    if force is None:
        return ImuReading(stamp_ns, (0.0, 0.0, rate), variance)
    return ImuReading(stamp_ns, (0.0, 0.0, rate), variance, force, (1e-3, 1e-3, 1e-3))


def record(reading: ImuReading) -> Record:
    return np.array([reading], IMU)[0]


@given(st.lists(st.integers(0, SIZE - 1), min_size=1, max_size=4, unique=True).map(tuple))
def test_selection_jacobian_selects_the_states(states: tuple[int, ...]) -> None:
    x = np.arange(SIZE) + 1.0
    assert np.array_equal(selection_jacobian(np.array(states)) @ x, x[list(states)])


def test_an_interval_needs_a_stamped_belief() -> None:
    with pytest.raises(OdometryError, match="no stamp"):
        _propagate(
            MODEL, FilterState.initial(MODEL), WheelTravel(0.0, 0.0, 0.0, 0.0), STEP_NS, EncoderState()
        )


@given(TRAVEL, TRAVEL)
def test_propagation_follows_the_arc_of_the_wheels(left: float, right: float) -> None:
    interval = interval_of(left, right, standing=True)
    move_to(interval, STEP_NS)
    s, yaw = 0.5 * (left + right), (right - left) / MODEL.separation
    half = SE2(0.0, 0.0, 0.5 * yaw)
    chord = s * np.sinc(0.5 * yaw / math.pi)
    end = half @ SE2(chord, 0.0, 0.0) @ half
    assert interval.state[[X, Y, YAW]] == pytest.approx((end.x, end.y, yaw), abs=1e-12)
    assert interval.state[[DELTA_S, DELTA_YAW]] == pytest.approx((s, yaw), abs=1e-12)
    assert interval.velocity == pytest.approx((s / 0.02, yaw / 0.02, 0.02))


@given(TRAVEL, TRAVEL, st.lists(st.integers(1, STEP_NS - 1), max_size=4))
@settings(max_examples=25)
def test_splitting_an_interval_gives_the_same_pose(left: float, right: float, stamps: list[int]) -> None:
    once, split = interval_of(left, right, standing=True), interval_of(left, right, standing=True)
    move_to(once, STEP_NS)
    for stamp in [*sorted(stamps), STEP_NS]:
        move_to(split, stamp)
    assert split.state == pytest.approx(once.state, abs=1e-12)
    assert split.covariance == pytest.approx(once.covariance, rel=1e-2, abs=1e-9)


def test_time_does_not_run_backwards_in_an_interval() -> None:
    interval = interval_of(0.01, 0.01)
    move_to(interval, STEP_NS)
    state = interval.state.copy()
    move_to(interval, STEP_NS // 2)
    assert np.array_equal(interval.state, state)


def test_a_slip_only_adds_uncertainty() -> None:
    sure, slipped = interval_of(0.01, 0.01), interval_of(0.01, 0.01)
    for interval in (sure, slipped):
        move_to(interval, STEP_NS)
    slip(slipped, 0.05)
    assert slipped.state == pytest.approx(sure.state)
    added = slipped.covariance - sure.covariance
    assert added[YAW, YAW] > 0.05**2 and np.linalg.eigvalsh(added).min() > -1e-12


def test_heading_can_be_added_and_inflated() -> None:
    interval = interval_of(0.0, 0.0)
    before, covariance = interval.state.copy(), interval.covariance.copy()
    add_heading(interval, 0.1)
    inflate_heading(interval, 0.04)
    assert interval.state[[YAW, DELTA_YAW]] == pytest.approx(before[[YAW, DELTA_YAW]] + 0.1)
    assert interval.covariance[YAW, YAW] == pytest.approx(covariance[YAW, YAW] + 0.04)


def test_a_reading_does_not_modify_the_belief_before_it() -> None:
    belief = process_reading(MODEL, FilterState.initial(MODEL), WheelCounts(0, 0, 0))
    arrays = belief.state, belief.covariance, belief.monitor_records, belief.memory
    before = [array.tobytes() for array in arrays]
    waiting = process_reading(MODEL, belief, imu(STEP_NS // 2, 0.5, (1.0, 0.5, GRAVITY)))
    process_reading(MODEL, waiting, WheelCounts(STEP_NS, 30, 40))
    assert [array.tobytes() for array in arrays] == before


def test_the_gyro_corrects_the_yaw_of_slipping_wheels() -> None:
    turning = 0.5
    interval = interval_of(0.0, 0.0, gyro_ns=0)
    move_to(interval, STEP_NS)
    update_gyro(interval, record(imu(STEP_NS, turning)))
    assert interval.part[0]["contradicted"]
    assert interval.state[YAW] == pytest.approx(turning * 0.02, rel=0.05)


@pytest.mark.parametrize("last_ns", [0, 1])
def test_a_saturated_gyro_inflates_the_heading(last_ns: int) -> None:
    interval = interval_of(0.0, 0.0, gyro_ns=0)
    note_reading(interval.monitors[GYRO], last_ns, np.zeros(3), 1.0)
    before = interval.covariance[YAW, YAW]
    move_to(interval, STEP_NS)
    update_gyro(interval, record(imu(STEP_NS, MODEL.gyro_range)))
    assert FAULTS[interval.monitors[GYRO]["fault"]] is Condition.SATURATED
    assert interval.covariance[YAW, YAW] > before + 0.5 * (MODEL.gyro_range * 0.02) ** 2


def test_gravity_along_the_tilted_axes_corrects_the_pitch() -> None:
    pitch = 0.05
    interval = interval_of(0.0, 0.0, True, dt=0.02)
    force = (-GRAVITY * math.sin(pitch), 0.0, GRAVITY * math.cos(pitch))
    for step in range(1, 200):
        interval.monitors[ACCELEROMETER] = new_monitors()[ACCELEROMETER]
        update_imu(interval, record(imu(step, force=force)))
    assert 0.0 < interval.state[PITCH] <= 1.1 * pitch


@given(st.lists(st.tuples(st.integers(-50, 50), st.integers(-50, 50)), min_size=2, max_size=8))
@settings(max_examples=25)
def test_wheel_counts_alone_integrate_to_the_dead_reckoned_pose(steps: list[tuple[int, int]]) -> None:
    belief, pose, left, right = FilterState.initial(MODEL), SE2(0.0, 0.0, 0.0), 0, 0
    belief = process_reading(MODEL, belief, WheelCounts(0, 0, 0))
    for k, (dl, dr) in enumerate(steps, 1):
        left, right = left + dl, right + dr
        belief = process_reading(MODEL, belief, WheelCounts(k * STEP_NS, left, right))
        metres = ROBOT.metres_per_tick
        half = SE2(0.0, 0.0, 0.5 * (dr - dl) * metres / MODEL.separation)
        chord = 0.5 * (dl + dr) * metres * np.sinc(half.yaw / math.pi)
        pose = pose @ half @ SE2(chord, 0.0, 0.0) @ half
    estimate = estimate_of(belief)
    assert estimate.pose.distance(pose) < 1e-3
    assert np.linalg.eigvalsh(estimate.covariance).min() > -1e-12
    assert estimate.twist_covariance.shape == (2, 2)


def test_readings_wait_for_the_next_wheel_reading() -> None:
    belief = process_reading(MODEL, FilterState.initial(MODEL), WheelCounts(0, 0, 0))
    waiting = process_reading(MODEL, belief, imu(STEP_NS // 2))
    assert len(waiting.pending) == 1 and np.array_equal(waiting.state, belief.state)
    after = process_reading(MODEL, waiting, WheelCounts(STEP_NS, 3, 3))
    assert after.pending == () and after.stamp_ns == STEP_NS
    again = process_reading(MODEL, after, WheelCounts(STEP_NS, 9, 9))
    assert np.array_equal(again.state, after.state) and again.counters == after.counters


def test_without_wheels_only_the_covariance_grows() -> None:
    belief = process_reading(MODEL, FilterState.initial(MODEL), WheelCounts(0, 0, 0))
    later = predict_without_wheels(MODEL, belief, 10 * STEP_NS)
    assert later.state[[X, Y, YAW]] == pytest.approx(belief.state[[X, Y, YAW]])
    assert later.covariance[X, X] > belief.covariance[X, X]
    assert predict_without_wheels(MODEL, later, STEP_NS) is later


def test_counts_after_a_long_gap_give_no_travel() -> None:
    belief = process_reading(MODEL, FilterState.initial(MODEL), WheelCounts(0, 0, 0))
    belief = process_reading(MODEL, belief, imu(BRIDGE_NS + 1))
    assert belief.counters.counts is None
    after = process_reading(MODEL, belief, WheelCounts(BRIDGE_NS + STEP_NS, 50_000, 50_000))
    assert abs(after.state[X]) < 1e-9 and after.counters.counts == (50_000, 50_000)
