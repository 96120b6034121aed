"""Wheels, gyro, accelerometer and matched scans to odometry."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
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
from chefbot.odometry.diagnostics import WELL, complaint
from chefbot.odometry.drive_model import Body
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import ImuReading, PoseReading, Triple, WheelCounts
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.robot.section import Mount
from chefbot.runtime.node import In, Node, Out, every, topic


class OdometryNode(Node):
    """Publishes the pose in the frame `odom` and odom -> base_footprint with every tick message.

    When the wheels fall silent it goes on publishing where the robot stopped, less and less certain.
    """

    params: OdometryParams
    wheel_ticks: In[WheelTicks]
    imu: In[Imu] = topic("imu/data")
    scan_match: In[PoseWithCovarianceStamped]
    """Poses in `odom`, from whoever matches scans; none is needed."""
    odom: Out[Odometry]
    tf_out: Out[TFMessage] = topic("tf")
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Begin at the origin of `odom`."""
        self._filter = Ekf(Body.of(self.robot, self.params))
        self._axes = _axes(self.robot.sensors.imu.mount)

    def on_imu(self, imu: Imu) -> None:
        """Keep it for the next tick message, or work it in where it belongs."""
        spec = self.robot.sensors.imu
        self._filter.add(
            ImuReading(
                imu.header.stamp.ns,
                self._turned(imu.angular_velocity),
                self._told(imu.angular_velocity_covariance, spec.gyro_noise),
                self._turned(imu.linear_acceleration),
                self._told(imu.linear_acceleration_covariance, spec.accelerometer_noise),
            )
        )

    def on_scan_match(self, match: PoseWithCovarianceStamped) -> None:
        """Correct the pose at the time of the scan."""
        full, plane = match.pose.covariance.reshape(6, 6), [0, 1, 5]
        a, b, c = full[np.ix_(plane, plane)].tolist()
        self._filter.add(
            PoseReading(match.header.stamp.ns, match.pose.pose.se2, (tuple(a), tuple(b), tuple(c)))
        )

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """Move the estimate on."""
        stamp, before = ticks.header.stamp.ns, self._filter.belief.stamp_ns
        self._filter.add(WheelCounts(stamp, ticks.left, ticks.right))
        if self._filter.belief.stamp_ns == stamp != before:
            self._publish(stamp, self._filter.estimate)

    @every(hz=10)
    def go_on(self) -> None:
        """Without wheels: the pose stays, its certainty does not."""
        if self._filter.condition(Source.WHEELS, self.now_ns) is Condition.LOST:
            self._publish(self.now_ns, self._filter.at(self.now_ns))

    @every(hz=1)
    def tell_health(self) -> None:
        """What is wrong with wheels or gyro, in words."""
        sentence = complaint(self._filter, self.now_ns)
        level = WARN if sentence else OK
        status = DiagnosticStatus(level, "odometry", sentence or WELL, self.robot.name)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))

    def _turned(self, vector: Vector3) -> Triple:
        """A vector of the sensor along the robot's axes."""
        x, y, z = (self._axes @ np.array([vector.x, vector.y, vector.z])).tolist()
        return x, y, z

    def _told(self, covariance: NDArray[np.float64], noise: float) -> Triple:
        """Variances along the robot's axes; as the robot file has it where the message says it is unknown.

        sensor_msgs/Imu: all zeros are unknown, a first element of -1 says that there is no such sensor.
        """
        if covariance[0] < 0.0:
            return math.inf, math.inf, math.inf
        told = covariance.reshape(3, 3) if covariance.any() else noise**2 * np.eye(3)
        x, y, z = (self._axes @ told @ self._axes.T).diagonal().tolist()
        return x, y, z

    def _publish(self, stamp: int, estimate: MotionEstimate) -> None:
        pose = PoseWithCovariance(Pose.of(estimate.pose), covariance_36(estimate.covariance))
        twist_covariance = covariance_36(_in_twist(estimate))
        twist = TwistWithCovariance(Twist.of(estimate.v, estimate.w), twist_covariance)
        self.odom.publish(Odometry(Header.of(stamp, "odom"), "base_footprint", pose, twist))
        transform = TransformStamped.of(stamp, "odom", "base_footprint", estimate.pose)
        self.tf_out.publish(TFMessage((transform,)))


def _axes(mount: Mount) -> NDArray[np.float64]:
    """base_R_sensor (3, 3) of a mount: turned by yaw, then tilted by pitch about its own y."""
    c, s, cp, sp = math.cos(mount.yaw), math.sin(mount.yaw), math.cos(mount.pitch), math.sin(mount.pitch)
    return np.array([[c * cp, -s, c * sp], [s * cp, c, s * sp], [-sp, 0.0, cp]])


def _in_twist(estimate: MotionEstimate) -> NDArray[np.float64]:
    """(3, 3) of forward, sideways, turning: the robot does not slide sideways."""
    full = np.zeros((3, 3))
    full[::2, ::2] = estimate.twist_covariance
    return full
