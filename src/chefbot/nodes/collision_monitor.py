"""The collision monitor's ports: sensors and odometry in, and what limits the motion out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.causes.motion_reasons import MotionReasonsNode
from chefbot.nodes.scans.deskewing import when_deskewed
from chefbot.robot.motion_limits import max_speed
from chefbot.runtime.node import In, Out, every, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.collision_monitor import CheckedTwist, CollisionMonitor
from chefbot.safety.command_multiplexer import StampedCommand
from chefbot.safety.known_obstacles import RememberedPoints
from chefbot.safety.latency import LatencyEstimator
from chefbot.safety.motion_policy import Restriction, SensorPolicy, SensorVerdict, restricted
from chefbot.safety.params import DriveBaseParams

COMMAND_RATE = 20.0
"""Rate of the commands to the wheels, Hz."""
COMMAND_PERIOD = 1.0 / COMMAND_RATE
"""Time between two commands, s."""
INITIAL_LATENCY = 0.15
"""Latency of the wheels before it is measured, s."""
MAX_POSE_AGE = 1.0
"""Age of the pose in odom that the distance to stop includes at most, s; an older one has stopped the robot."""
NO_POINTS = np.zeros((0, 2))
STATUS, OK_MESSAGE = "collision monitor", "Nothing limits the motion."
"""Name of the status in /diagnostics, and its message while nothing is wrong."""


class CollisionMonitorNode(MotionReasonsNode):
    """Base class of the node that commands the wheels: each of its twists is checked with the newest sensor data.

    It publishes why the robot stands or is slow on /diagnostics as well.
    """

    params: DriveBaseParams
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    ultrasonic: In[Range]
    board_fault: In[String]
    stop_reason: Out[String] = topic("base/stop_reason", latched=True)
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Start with an empty memory."""
        super().start()
        params = self.params
        self._monitor = CollisionMonitor(self.robot, params.monitor, params.ultrasonic_margin)
        self._policy = SensorPolicy(self.robot, params.monitor.optional_sensors)
        self._latency = LatencyEstimator(COMMAND_PERIOD, max_speed(self.robot), INITIAL_LATENCY)
        # nothing has been seen yet; teleoperation that begins now is not interrupted when the sensors come
        self._verdict = SensorVerdict(Restriction.STOP_UNLESS_TELEOP)
        self._last_pose: tuple[SE2, int] | None = None

    # -- sensors

    def on_scan(self, scan: LaserScan) -> None:
        """Take a scan into the memory as soon as its pose in odom is known."""
        sensors, stamp_ns = self._policy.obstacle_sensors, scan.header.stamp.ns
        sensors.process_scan(scan, self.now_ns, self._pose()[0])

        def place(still: LaserScan, sensor: SE2) -> None:
            self._monitor.process_scan(still, sensor)
            sensors.note_scan_marked(stamp_ns)

        when_deskewed(self.tf, scan, scan.header.frame_id, place)

    def on_obstacles(self, scan: ObstacleScan) -> None:
        """Take an obstacle scan into the memory as soon as its pose in odom is known."""
        sensors, stamp_ns = self._policy.obstacle_sensors, scan.header.stamp.ns
        sensors.process_obstacles(scan, self.now_ns, self._pose()[0])

        def place(sensor: SE2) -> None:
            self._monitor.process_obstacles(scan, sensor)
            sensors.note_obstacles_marked(stamp_ns)

        self.tf.on_available("odom", scan.header.frame_id, stamp_ns, place)

    def on_ultrasonic(self, echo: Range) -> None:
        """Take an echo of the ultrasonic ranger."""
        self._monitor.process_echo(echo)
        if self._policy.ranger is not None:
            self._policy.ranger.process_echo(echo, self.now_ns)

    def _pose(self) -> tuple[SE2 | None, int | None]:
        """Return the newest pose in odom and its time; no time if the transforms are fixed, no pose without them."""
        try:
            return self.tf.lookup("odom", "base_link"), self.tf.newest_stamp("odom", "base_link")
        except TransformError:
            return None, None

    # -- twists

    def _judge_sensors(self) -> SensorVerdict:
        """Judge the sensors as they will be when the next command is due, so that none is too old until then.

        A fault for which the motor board has switched its motors off comes before those of sensors.
        """
        (pose, pose_ns), now_ns = self._pose(), self.now_ns

        def points() -> NDArray[np.float64]:
            return self._monitor.points(pose, now_ns, self._monitor.reach) if pose is not None else NO_POINTS

        before = self._verdict
        due_ns = now_ns + round(COMMAND_PERIOD * 1e9)
        known = RememberedPoints(points, self._monitor.polygons.resolution)
        judged = self._policy.judge(due_ns, pose, pose_ns, known)
        self._verdict = judged.with_board_fault(self.board_fault.last.data if self.board_fault.last else "")
        if before.stop_reason != self._verdict.stop_reason:
            self.stop_reason.publish(String(self._verdict.stop_reason))
        return self._verdict

    def _allowed_fraction(self, command: StampedCommand) -> float:
        """Return the fraction of a command that faults of sensors and of the motor board leave."""
        slow = self.params.monitor.slowdown_ratio * max_speed(self.robot)
        return restricted(command, self._verdict, self.robot.circumscribed_radius, slow)

    def _checked(self, v: float, w: float) -> CheckedTwist:
        """Check the twist (m/s, rad/s) that is due now."""
        pose, pose_ns = self._pose()
        self._measure_latency(v, pose, pose_ns)
        age = 0.0 if pose_ns is None else min(max(0.0, (self.now_ns - pose_ns) / 1e9), MAX_POSE_AGE)
        at = pose or IDENTITY  # without a pose nothing was placed: what remains is the ultrasonic ranger
        return self._monitor.check(v, w, at, self.now_ns, self._latency.latency + COMMAND_PERIOD + age)

    def _measure_latency(self, v: float, pose: SE2 | None, pose_ns: int | None) -> None:
        if pose is None or pose_ns is None:
            return
        before, self._last_pose = self._last_pose, (pose, pose_ns)
        if before is not None and pose_ns > before[1]:
            self._latency.process(v, before[0].between(pose).x / ((pose_ns - before[1]) / 1e9))

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish what limits the motion, also while the robot stands; again, as others can publish it as well."""
        self.stop_reason.publish(String(self._verdict.stop_reason))
        sentence = self._reasons.sentence
        level = ERROR if self._verdict.requires_stop else WARN if sentence else OK
        status = DiagnosticStatus(level, STATUS, sentence or OK_MESSAGE, self.robot.name)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))
