"""Wheels and gyro to odometry."""

from __future__ import annotations

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
    covariance_36,
)
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.gyro_ekf import GyroEkf
from chefbot.odometry.params import OdometryParams
from chefbot.runtime.node import In, Node, Out, every, topic

GYRO_TIMEOUT_NS = 100_000_000
"""An older reading of the gyro says nothing of the present turn."""


class OdometryNode(Node):
    """Publishes the pose in the frame `odom` and odom -> base_footprint with every tick message."""

    params: OdometryParams
    wheel_ticks: In[WheelTicks]
    imu: In[Imu] = topic("imu/data")
    odom: Out[Odometry]
    tf_out: Out[TFMessage] = topic("tf")
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Begin at the origin of `odom`."""
        self._filter = GyroEkf(self.robot, self.params)
        self._last_ns = 0

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """Move the estimate on."""
        stamp = ticks.header.stamp.ns
        dt = (stamp - self._last_ns) / 1e9 if self._last_ns else 1.0
        if dt <= 0.0:
            return  # read twice, or the board's clock stepped back: nothing new is known
        self._last_ns = stamp
        estimate = self._filter.update(ticks.left, ticks.right, self._gyro(stamp), dt)
        self._publish(stamp, estimate)

    @every(hz=1)
    def tell_health(self) -> None:
        """What is wrong with wheels or gyro, in words."""
        level, sentence = OK, "Wheels and gyro agree."
        if self._filter.slipping:
            level, sentence = WARN, "Wheels and gyro contradict each other: the wheels slip."
        elif self._last_ns and self._filter.gyro_age > GYRO_TIMEOUT_NS / 1e9:
            age = min(self._filter.gyro_age, self.now_ns / 1e9)
            level, sentence = WARN, f"No gyro for {age:.1f} s: going on with the wheels alone."
        status = DiagnosticStatus(level, "odometry", sentence, self.robot.name)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))

    def _gyro(self, stamp: int) -> float | None:
        reading = self.imu.last
        if reading is None or stamp - reading.header.stamp.ns > GYRO_TIMEOUT_NS:
            return None
        return reading.angular_velocity.z

    def _publish(self, stamp: int, estimate: MotionEstimate) -> None:
        pose = PoseWithCovariance(Pose.of(estimate.pose), covariance_36(estimate.covariance))
        twist_covariance = covariance_36(_in_twist(estimate))
        twist = TwistWithCovariance(Twist.of(estimate.v, estimate.w), twist_covariance)
        self.odom.publish(Odometry(Header.of(stamp, "odom"), "base_footprint", pose, twist))
        transform = TransformStamped.of(stamp, "odom", "base_footprint", estimate.pose)
        self.tf_out.publish(TFMessage((transform,)))


def _in_twist(estimate: MotionEstimate) -> NDArray[np.float64]:
    """(3, 3) of forward, sideways, turning: the robot does not slide sideways."""
    full = np.zeros((3, 3))
    full[::2, ::2] = estimate.twist_covariance
    return full
