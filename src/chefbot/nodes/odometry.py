"""Odometry from wheel encoders and IMU by an extended Kalman filter."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.odometry.diagnostics import NO_FAULT, diagnostic_message
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.messages import ImuConverter, odometry_message
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import WheelCounts
from chefbot.odometry.sensor_health import Condition, Source
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
        self._imu = ImuConverter(self.robot)

    def on_imu(self, imu: Imu) -> None:
        """Add an IMU reading in the robot's axes to the filter."""
        self._filter.add(self._imu.reading(imu))

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

    def _publish(self, stamp: int, estimate: MotionEstimate) -> None:
        self.odom.publish(odometry_message(stamp, estimate))
        transform = TransformStamped.of(stamp, "odom", "base_footprint", estimate.pose)
        self.tf_out.publish(TFMessage((transform,)))
