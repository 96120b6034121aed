"""The group of planar motions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2

metres = st.floats(-100, 100)
poses = st.builds(SE2, metres, metres, st.floats(-10, 10))
points = hnp.arrays(np.float64, (3, 2), elements=st.floats(-100, 100))


def close(a, b):
    assert (a.x, a.y) == pytest.approx((b.x, b.y), abs=1e-9)
    assert wrap(a.yaw - b.yaw) == pytest.approx(0.0, abs=1e-12)


@given(poses, poses, poses)
def test_poses_form_a_group(a, b, c):
    close((a @ b) @ c, a @ (b @ c))
    close(a @ IDENTITY, a)
    close(IDENTITY @ a, a)
    close(a @ a.inverse(), IDENTITY)
    close(a.inverse() @ a, IDENTITY)
    close((a @ b).inverse(), b.inverse() @ a.inverse())
    close(a @ a.between(b), b)


@given(poses, poses, points)
def test_composition_equals_applying_to_points(a, b, cloud):
    assert np.allclose((a @ b).apply(cloud), a.apply(b.apply(cloud)), atol=1e-9)
    assert np.allclose(a.inverse().apply(a.apply(cloud)), cloud, atol=1e-9)
    lengths = np.linalg.norm(cloud - cloud[0], axis=1)
    moved = a.apply(cloud)
    assert np.allclose(np.linalg.norm(moved - moved[0], axis=1), lengths, atol=1e-9)


def test_forward_is_x_left_is_y_and_turns_are_counter_clockwise():
    facing_left = SE2(1.0, 2.0, math.pi / 2)
    close(facing_left @ SE2(3.0, 0.0, 0.0), SE2(1.0, 5.0, math.pi / 2))
    assert np.allclose(facing_left.apply(np.array([[0.0, 1.0]])), [[0.0, 2.0]])
    assert facing_left.distance(SE2(4.0, 6.0, 1.0)) == 5.0


@given(poses)
def test_arrays_transform_point_by_point(a):
    assert SE2.of(a.array()) == a
    assert a.array().shape == (3,) and a.array().dtype == np.float64


@given(st.floats(-1e6, 1e6))
def test_wrap_keeps_the_direction_within_the_interval(angle):
    wrapped = wrap(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@pytest.mark.parametrize("angle", [math.pi, -math.pi, math.nextafter(-math.pi, -4), -1e-17, 0.0, 3 * math.pi])
def test_wrap_at_the_interval_ends(angle):
    assert -math.pi <= wrap(angle) < math.pi


def test_wrap_keeps_nan_and_infinity_invalid():
    assert math.isnan(wrap(math.nan))
