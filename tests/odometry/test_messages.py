"""Messages to readings and back: axes of the mount, unknown variances, covariances in the order of ROS."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Vector3
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Header
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.messages import ImuConverter, mount_rotation, odometry_message
from chefbot.odometry.readings import UNMEASURED_VARIANCES
from chefbot.robot.load import load_robot
from chefbot.robot.section import Mount
from chefbot.robot.spec import Robot

ROBOT = load_robot("chefbot")
ANGLES = st.floats(-math.pi, math.pi)
VECTORS = st.tuples(*[st.floats(-20.0, 20.0)] * 3)


def mounted(yaw: float = 0.0, pitch: float = 0.0) -> Robot:
    mount = msgspec.structs.replace(ROBOT.sensors.imu.mount, yaw=yaw, pitch=pitch)
    imu = msgspec.structs.replace(ROBOT.sensors.imu, mount=mount)
    return msgspec.structs.replace(ROBOT, sensors=msgspec.structs.replace(ROBOT.sensors, imu=imu))


def message(
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
    force: tuple[float, float, float] = (0.0, 0.0, 0.0),
    covariance: list[float] | None = None,
) -> Imu:
    matrix = np.array(covariance or [0.0] * 9)
    return Imu(
        Header.of(7, "imu_link"), angular_velocity=Vector3(*rates), angular_velocity_covariance=matrix,
        linear_acceleration=Vector3(*force), linear_acceleration_covariance=matrix,
    )  # fmt: skip


@given(ANGLES, ANGLES)
def test_the_rotation_of_a_mount_is_a_rotation(yaw: float, pitch: float) -> None:
    mount = msgspec.structs.replace(ROBOT.sensors.imu.mount, yaw=yaw, pitch=pitch)
    assert isinstance(mount, Mount)
    R = mount_rotation(mount)
    assert pytest.approx(np.eye(3), abs=1e-12) == R @ R.T
    assert np.linalg.det(R) == pytest.approx(1.0)
    ahead = R @ np.array([1.0, 0.0, 0.0])
    assert ahead[2] == pytest.approx(-math.sin(pitch)), "a positive pitch looks down (REP 103)"
    assert R @ np.array([0.0, 1.0, 0.0]) == pytest.approx([-math.sin(yaw), math.cos(yaw), 0.0])


@given(VECTORS, ANGLES)
def test_a_turned_sensor_measures_the_same_motion(rates: tuple[float, float, float], yaw: float) -> None:
    c, s = math.cos(yaw), math.sin(yaw)
    x, y, z = rates
    seen = (c * x + s * y, -s * x + c * y, z)  # in the axes of a sensor that is turned to the left by yaw
    reading = ImuConverter(mounted(yaw)).reading(message(seen, seen))
    assert reading.stamp_ns == 7
    assert reading.rates == pytest.approx(rates, abs=1e-9)
    assert reading.force == pytest.approx(rates, abs=1e-9)


def test_gravity_in_a_sensor_that_looks_down_is_up_in_the_robot() -> None:
    pitch = 0.3
    seen = (-9.8 * math.sin(pitch), 0.0, 9.8 * math.cos(pitch))
    assert ImuConverter(mounted(0.0, pitch)).reading(message(force=seen)).force == pytest.approx(
        (0.0, 0.0, 9.8)
    )


@given(ANGLES, ANGLES)
def test_unknown_variances_are_those_of_the_robot_file(yaw: float, pitch: float) -> None:
    reading, imu = ImuConverter(mounted(yaw, pitch)).reading(message()), ROBOT.sensors.imu
    assert reading.rates_variance == pytest.approx((imu.gyro_noise**2,) * 3)
    assert reading.force_variance == pytest.approx((imu.accelerometer_noise**2,) * 3)


def test_given_variances_turn_with_the_mount() -> None:
    covariance = [4.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.25]
    straight = ImuConverter(mounted()).reading(message(covariance=covariance))
    turned = ImuConverter(mounted(math.pi / 2)).reading(message(covariance=covariance))
    assert straight.rates_variance == straight.force_variance == pytest.approx((4.0, 1.0, 0.25))
    assert turned.rates_variance == turned.force_variance == pytest.approx((1.0, 4.0, 0.25))


def test_a_sensor_that_is_absent_measures_nothing() -> None:
    reading = ImuConverter(mounted(0.5)).reading(message(covariance=[-1.0] + [0.0] * 8))
    assert reading.rates_variance == reading.force_variance == UNMEASURED_VARIANCES


def test_covariances_stand_where_ros_has_them() -> None:
    covariance, twist = np.arange(9.0).reshape(3, 3), np.array([[1.0, 2.0], [2.0, 5.0]])
    made = odometry_message(42, MotionEstimate(SE2(1.0, 2.0, 0.5), covariance, 0.3, -0.2, twist))
    assert (made.header.stamp.ns, made.header.frame_id, made.child_frame_id) == (42, "odom", "base_footprint")
    assert (made.pose.pose.position.x, made.pose.pose.position.y) == (1.0, 2.0)
    assert made.pose.pose.orientation.yaw == pytest.approx(0.5)
    assert (made.twist.twist.linear.x, made.twist.twist.angular.z) == (0.3, -0.2)
    pose, speed = (part.covariance.reshape(6, 6) for part in (made.pose, made.twist))
    at = np.ix_([0, 1, 5], [0, 1, 5])  # x, y and the rotation about z of six
    assert np.array_equal(pose[at], covariance)
    assert np.array_equal(speed[at], [[1.0, 0.0, 2.0], [0.0, 0.0, 0.0], [2.0, 0.0, 5.0]]), "v_y is exactly 0"
