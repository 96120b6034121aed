"""Odometry from wheel encoders and IMU by an extended Kalman filter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseWithCovariance,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
    covariance_36,
)
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.odometry.diagnostics import NO_FAULT, diagnostic_message
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import ImuReading, Triple, WheelCounts
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.robot.section import Mount
from chefbot.runtime.node import In, Node, Out, every, topic


class OdometryNode(Node):
    """Publishes the pose in the frame `odom` and odom -> base_footprint with every tick message.

    When tick messages stop arriving it keeps publishing the predicted pose with growing covariance.
    """

    params: OdometryParams
    wheel_ticks: In[WheelTicks]
    imu: In[Imu] = topic("imu/data")
    odom: Out[Odometry]
    tf_out: Out[TFMessage] = topic("tf")
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Create the filter at the origin of `odom`."""
        self._filter = Ekf(DriveModel.of(self.robot, self.params))
        self._imu_rotation = _imu_rotation(self.robot.sensors.imu.mount)

    def on_imu(self, imu: Imu) -> None:
        """Add an IMU reading in the robot's axes to the filter."""
        spec = self.robot.sensors.imu
        self._filter.add(
            ImuReading(
                imu.header.stamp.ns,
                self._to_base_axes(imu.angular_velocity),
                self._variances(imu.angular_velocity_covariance, spec.gyro_noise),
                self._to_base_axes(imu.linear_acceleration),
                self._variances(imu.linear_acceleration_covariance, spec.accelerometer_noise),
            )
        )

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """Propagate the estimate with the wheel counts and publish it."""
        stamp, previous_ns = ticks.header.stamp.ns, self._filter.belief.stamp_ns
        self._filter.add(WheelCounts(stamp, ticks.left, ticks.right))
        if self._filter.belief.stamp_ns == stamp != previous_ns:
            self._publish(stamp, self._filter.estimate)

    @every(hz=10)
    def publish_prediction(self) -> None:
        """Publish the predicted pose with growing covariance while wheel ticks are lost."""
        if self._filter.condition(Source.WHEELS, self.now_ns) is Condition.LOST:
            self._publish(self.now_ns, self._filter.at(self.now_ns))

    @every(hz=1)
    def report_health(self) -> None:
        """Publish the health of wheels and gyro as diagnostics."""
        sentence = diagnostic_message(self._filter, self.now_ns)
        level = WARN if sentence else OK
        status = DiagnosticStatus(level, "odometry", sentence or NO_FAULT, self.robot.name)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))

    def _to_base_axes(self, vector: Vector3) -> Triple:
        """Rotate a vector of the sensor into the robot's axes."""
        x, y, z = (self._imu_rotation @ np.array([vector.x, vector.y, vector.z])).tolist()
        return x, y, z

    def _variances(self, covariance: NDArray[np.float64], noise: float) -> Triple:
        """Return the variances along the robot's axes, from the robot file if the message has none.

        sensor_msgs/Imu: all zeros mean unknown, a first element of -1 means that there is no such sensor.
        """
        if covariance[0] < 0.0:
            return math.inf, math.inf, math.inf
        matrix = covariance.reshape(3, 3) if covariance.any() else noise**2 * np.eye(3)
        x, y, z = (self._imu_rotation @ matrix @ self._imu_rotation.T).diagonal().tolist()
        return x, y, z

    def _publish(self, stamp: int, estimate: MotionEstimate) -> None:
        pose = PoseWithCovariance(Pose.of(estimate.pose), covariance_36(estimate.covariance))
        twist_covariance = covariance_36(_twist_covariance(estimate))
        twist = TwistWithCovariance(Twist.of(estimate.v, estimate.w), twist_covariance)
        self.odom.publish(Odometry(Header.of(stamp, "odom"), "base_footprint", pose, twist))
        transform = TransformStamped.of(stamp, "odom", "base_footprint", estimate.pose)
        self.tf_out.publish(TFMessage((transform,)))


def _imu_rotation(mount: Mount) -> NDArray[np.float64]:
    """Return base_R_sensor (3, 3) of a mount: rotated by yaw, then by pitch about its own y axis."""
    c, s, cp, sp = math.cos(mount.yaw), math.sin(mount.yaw), math.cos(mount.pitch), math.sin(mount.pitch)
    return np.array([[c * cp, -s, c * sp], [s * cp, c, s * sp], [-sp, 0.0, cp]])


def _twist_covariance(estimate: MotionEstimate) -> NDArray[np.float64]:
    """Return the twist covariance (3, 3) of v_x, v_y, w; v_y is exactly 0."""
    covariance = np.zeros((3, 3))
    covariance[::2, ::2] = estimate.twist_covariance
    return covariance
