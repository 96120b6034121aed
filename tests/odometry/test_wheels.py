"""Tests encoder counters that wrap around and restart, the geometry of arcs, and the motion model."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synchronous import SynchronousEkf

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.motion_model import GYRO_BIAS_X, GYRO_BIAS_Y, INPUTS, SIZE, YAW, arc, predict
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import WheelCounts
from chefbot.odometry.wheel_travel import EncoderState, tick_difference, travel_from_counts
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
DT = 0.02
ticks = st.integers(-60, 60)
steps = st.lists(st.tuples(ticks, ticks), min_size=1, max_size=60)


@given(bits=st.integers(2, 64), start=st.integers(-(2**63), 2**63 - 1), data=st.data())
def test_tick_difference_survives_the_wrap_of_any_counter(bits, start, data):
    moved = data.draw(st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1))
    mask = 2**bits - 1
    assert tick_difference((start + moved) & mask, start & mask, bits) == moved


@given(steps, st.integers(0, 2**16 - 1), st.integers(0, 2**16 - 1))
def test_a_wrapping_counter_gives_the_same_poses(moves, left, right):
    wide, narrow = SynchronousEkf(ROBOT), SynchronousEkf(ROBOT, counter_bits=16)
    for a, b in moves:
        left, right = left + a, right + b
        first = wide.update(left, right, DT)
        second = narrow.update(left % 2**16, right % 2**16, DT)
        assert first.pose == second.pose


@given(steps)
def test_driving_back_the_same_way_returns_to_the_start(moves):
    odometry, left, right = SynchronousEkf(ROBOT), 0, 0
    odometry.update(0, 0, DT)
    for a, b in moves + [(-a, -b) for a, b in reversed(moves)]:
        left, right = left + a, right + b
        estimate = odometry.update(left, right, DT)
    assert np.allclose(estimate.pose.array(), 0.0, atol=1e-12)


@given(st.floats(-3, 3), st.floats(-6, 6))
def test_arc_agrees_with_the_centre_of_curvature(step, turn):
    forward, aside = arc(step, turn)
    if abs(turn) > 1e-3:
        radius = step / turn
        assert forward == pytest.approx(radius * math.sin(turn), abs=1e-9)
        assert aside == pytest.approx(radius * (1.0 - math.cos(turn)), abs=1e-9)
    else:
        assert forward == pytest.approx(step, abs=1e-5)
        assert aside == pytest.approx(0.5 * step * turn, abs=1e-5)


def test_arc_is_smooth_near_straight_motion():
    for turn in (1e-3, 1e-4, 1e-6, 1e-9, 1e-13, 5e-324, 0.0):
        forward, aside = arc(1.0, turn)
        assert forward == pytest.approx(1.0 - turn**2 / 6.0, abs=1e-12)
        assert aside == pytest.approx(0.5 * turn, rel=1e-6, abs=1e-300)


@pytest.mark.parametrize("parts", [1, 7, 400])
def test_a_full_circle_closes_for_any_step_size(parts):
    pose = SE2(1.0, -2.0, 0.3)
    for _ in range(parts):
        pose = pose @ SE2(*arc(2.0 * math.pi * 0.7 / parts, 2.0 * math.pi / parts), 2.0 * math.pi / parts)
    assert np.allclose(pose.array(), (1.0, -2.0, 0.3), atol=1e-12)


small = st.floats(-0.05, 0.05)


def numeric_jacobian(step, at, size):
    """Return the Jacobian of `step` at `at` by central differences."""
    h, directions = 1e-6, np.eye(size)
    return np.array([(step(at + h * d) - step(at - h * d)) / (2 * h) for d in directions]).T


@given(left=small, right=small, yaw=st.floats(-3, 3), tilt=st.tuples(small, small), data=st.data())
def test_the_jacobian_is_the_numeric_derivative(left, right, yaw, tilt, data):
    """The propagated covariance of an error along one direction is the outer product of the derivative."""
    state = np.array(data.draw(st.lists(small, min_size=SIZE, max_size=SIZE)))
    state[YAW], inputs = yaw, np.array([left, right, *tilt])
    nothing, quiet, seconds = np.zeros((SIZE, SIZE)), np.zeros((INPUTS, INPUTS)), 0.1

    def step(x, u):
        return predict(x, nothing, u[:2], u[2:], seconds, quiet, 0.3, 0.2, 0.0)[0]

    def spread(covariance, noise):
        return predict(state, covariance, inputs[:2], inputs[2:], seconds, noise, 0.3, 0.2, 0.0)[1]

    by_state = numeric_jacobian(lambda x: step(x, inputs), state, SIZE)
    by_input = numeric_jacobian(lambda u: step(state, u), inputs, 4)
    for k, direction in enumerate(np.eye(SIZE)):
        expected = np.outer(by_state[:, k], by_state[:, k])
        assert np.allclose(spread(np.outer(direction, direction), quiet), expected, atol=1e-8)
    for k, direction in enumerate(np.eye(INPUTS)[:4]):
        expected = np.outer(by_input[:, k], by_input[:, k])
        assert np.allclose(spread(nothing, np.outer(direction, direction)), expected, atol=1e-8)


@given(roll=small, pitch=small, yaw=st.floats(-3, 3), step=small)
def test_on_a_slope_the_distance_is_projected(roll, pitch, yaw, step):
    """A positive pitch (REP-103) leads downward, and the distance along the slope is kept."""
    state = np.zeros(SIZE)
    state[3:6] = roll, pitch, yaw
    none = np.zeros((INPUTS, INPUTS))
    still, both = np.zeros(2), np.array([step, step])
    moved, _ = predict(state, np.zeros((SIZE, SIZE)), both, still, 0.0, none, 0.3, 0.0, 0.0)
    assert moved[2] == pytest.approx(-step * math.sin(pitch), abs=1e-12)
    assert np.linalg.norm(moved[:3]) == pytest.approx(abs(step), abs=1e-12)
    assert np.allclose(moved[3:6], state[3:6])
    assert not moved[[GYRO_BIAS_X, GYRO_BIAS_Y]].any()


@given(steps)
def test_covariance_is_symmetric_positive_semidefinite(moves):
    odometry, left, right = SynchronousEkf(ROBOT), 0, 0
    for a, b in moves:
        left, right = left + a, right + b
        covariance = odometry.update(left, right, DT).covariance
        assert np.allclose(covariance, covariance.T, rtol=1e-12, atol=1e-18)
        assert np.linalg.eigvalsh(covariance).min() > -1e-15


def test_straight_motion_always_grows_the_covariance():
    odometry, before = SynchronousEkf(ROBOT), np.zeros(3)
    odometry.update(0, 0, DT)
    for k in range(1, 200):
        variances = np.diag(odometry.update(80 * k, 80 * k, DT).covariance)
        assert (variances > before).all()
        before = variances


def test_a_standing_robot_does_not_grow_the_covariance():
    odometry = SynchronousEkf(ROBOT)
    for k in range(50):
        odometry.update(20 * k, 22 * k, DT)
    for _ in range(20):  # longer than the detection of standstill takes
        stopped = odometry.update(20 * 49, 22 * 49, DT)
    for _ in range(500):
        later = odometry.update(20 * 49, 22 * 49, DT)
    assert np.array_equal(stopped.covariance, later.covariance)
    assert later.v == 0.0 and later.w == 0.0


def test_a_restarted_board_does_not_move_the_pose():
    odometry = SynchronousEkf(ROBOT)
    for k in range(100):
        before = odometry.update(100_000 + 50 * k, 100_000 + 50 * k, DT)
    after = odometry.update(0, 0, DT)
    assert odometry.belief.counters.restarts == 1
    assert after.pose == before.pose
    assert after.covariance[0, 0] > before.covariance[0, 0] + 1e-5


def test_the_fastest_possible_motion_is_not_a_restart():
    body, counters = DriveModel.of(ROBOT, OdometryParams(), 32), EncoderState(counts=(0, 0))
    full = int(ROBOT.motor.no_load_speed * ROBOT.wheel_radius * DT / ROBOT.metres_per_tick)
    for k in range(10):
        counters, rolled = travel_from_counts(body, counters, WheelCounts(0, full * k, -full * k), 20_000_000)
    assert counters.restarts == 0
    assert rolled.left == -rolled.right == pytest.approx(full * ROBOT.metres_per_tick)


def test_start_pose_and_twist_are_reported():
    odometry = SynchronousEkf(ROBOT, start=SE2(1.0, 2.0, math.pi / 2))
    odometry.update(0, 0, DT)
    estimate = odometry.update(100, 100, DT)
    metres = 100 * ROBOT.metres_per_tick
    assert estimate.pose == pytest.approx((1.0, 2.0 + metres, math.pi / 2))
    assert (estimate.v, estimate.w) == pytest.approx((metres / DT, 0.0))
    assert SynchronousEkf(ROBOT).update(7, 9, DT).pose == IDENTITY, (
        "the first counts only initialize the encoders"
    )
