"""Joint state publisher: wheel angles on /joint_states, and the wheels' frames on /tf as in robot_state_publisher."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.urdf_frames import joint_name
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from chefbot.msgs.sensor_msgs import JointState
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.solids import link_origin
from chefbot.robot.spec import Robot
from chefbot.runtime.node import In, Node, NoParams, Out, every, topic

WHEELS = tuple(f"wheel_{side}_link" for side in layout.SIDES)
JOINTS = tuple(map(joint_name, WHEELS))
PERIOD_NS = 40_000_000
"""Minimum time between two messages, ns: 25 Hz look smooth."""
SILENCE_NS = 1_000_000_000
"""Time without ticks after which the last positions are repeated for late-joining subscribers, ns."""
MAX_SPEED_RATIO = 1.5
"""Multiple of the no-load speed above which a velocity is invalid, as after a reset of the tick counters."""


class JointStatesNode(Node):
    """Publishes wheel positions in rad, forward positive and never wrapped, and mean velocities in rad/s.

    Before the first ticks, and without a board, the joints are at zero.
    """

    params: NoParams
    wheel_ticks: In[WheelTicks]
    joint_states: Out[JointState]
    tf_out: Out[TFMessage] = topic("tf")

    def start(self) -> None:
        """Start with all joints at zero."""
        self._origins = [Vector3(*link_origin(self.robot, link)) for link in WHEELS]
        self._positions = np.zeros(len(WHEELS))
        self._ticks_ns: int | None = None
        self._published_ns = self.now_ns - SILENCE_NS

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """Publish the joint states, at most every PERIOD_NS."""
        stamp, previous_ns = ticks.header.stamp.ns, self._ticks_ns
        if previous_ns is not None and 0 <= stamp - previous_ns < PERIOD_NS:
            return
        positions, previous = wheel_positions(ticks, self.robot), self._positions
        self._positions, self._ticks_ns = positions, stamp
        time_ns = 0 if previous_ns is None else stamp - previous_ns
        self._publish(stamp, self._velocities(positions - previous, time_ns))

    def _velocities(self, angles: NDArray[np.float64], time_ns: int) -> NDArray[np.float64] | None:
        """Return the velocities in rad/s, or None if they are not valid."""
        if not 0 < time_ns < SILENCE_NS:
            return None
        velocities = angles / (time_ns / 1e9)
        fastest = MAX_SPEED_RATIO * self.robot.motor.no_load_speed
        return velocities if np.abs(velocities).max() < fastest else None

    @every(hz=1)
    def repeat_positions(self) -> None:
        """Repeat the last positions while no ticks arrive."""
        if self.now_ns - self._published_ns >= SILENCE_NS:
            self._publish(self.now_ns, None)

    def _publish(self, stamp_ns: int, velocities: NDArray[np.float64] | None) -> None:
        self._published_ns = self.now_ns
        velocity = np.zeros(0) if velocities is None else velocities
        self.joint_states.publish(JointState(Header.of(stamp_ns, ""), JOINTS, self._positions, velocity))
        wheels = zip(WHEELS, self._origins, self._positions.tolist(), strict=True)
        self.tf_out.publish(TFMessage(tuple(_wheel_transform(stamp_ns, *wheel) for wheel in wheels)))


def wheel_positions(ticks: WheelTicks, robot: Robot) -> NDArray[np.float64]:
    """Return the angles of JOINTS, (2,) rad."""
    counts = {"left": ticks.left, "right": ticks.right}
    return np.array([counts[side] / robot.motor.ticks_per_radian for side in layout.SIDES])


def _wheel_transform(stamp_ns: int, link: str, origin: Vector3, angle: float) -> TransformStamped:
    """Return `base_link_T_wheel`, rotated about the axle y (REP-103: forward is positive)."""
    half = math.remainder(angle, 2.0 * math.tau) / 2.0
    rotation = Quaternion(0.0, math.sin(half), 0.0, math.cos(half))
    return TransformStamped(Header.of(stamp_ns, "base_link"), link, Transform(origin, rotation))
