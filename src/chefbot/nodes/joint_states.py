"""How far the wheels have turned: /joint_states, and the wheels' frames on /tf as robot_state_publisher has them."""

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
"""Least time between two messages: 25 a second are smooth to the eye."""
SILENCE_NS = 1_000_000_000
"""After so long without ticks the wheels are told where they were, for those who come late, without a speed."""
POSSIBLE = 1.5
"""Times the motors' free speed; a board that began to count anew seems faster."""


class JointStatesNode(Node):
    """Positions in radians, forward positive and never wrapped; velocities in rad/s since the message before.

    Before the first ticks, and where no board is, the joints are at zero.
    """

    params: NoParams
    wheel_ticks: In[WheelTicks]
    joint_states: Out[JointState]
    tf_out: Out[TFMessage] = topic("tf")

    def start(self) -> None:
        """At zero."""
        self._origins = [Vector3(*link_origin(self.robot, link)) for link in WHEELS]
        self._positions = np.zeros(len(WHEELS))
        self._ticks_ns: int | None = None
        self._said_ns = self.now_ns - SILENCE_NS

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """As often as PERIOD_NS allows."""
        stamp, before = ticks.header.stamp.ns, self._ticks_ns
        if before is not None and 0 <= stamp - before < PERIOD_NS:
            return
        positions, was = wheel_positions(ticks, self.robot), self._positions
        self._positions, self._ticks_ns = positions, stamp
        self._say(stamp, None if before is None else self._velocities(positions - was, stamp - before))

    def _velocities(self, turned: NDArray[np.float64], time_ns: int) -> NDArray[np.float64] | None:
        """None where they cannot be told."""
        if not 0 < time_ns < SILENCE_NS:
            return None
        velocities = turned / (time_ns / 1e9)
        return velocities if np.abs(velocities).max() < POSSIBLE * self.robot.motor.no_load_speed else None

    @every(hz=1)
    def remind(self) -> None:
        """Where the board is silent."""
        if self.now_ns - self._said_ns >= SILENCE_NS:
            self._say(self.now_ns, None)

    def _say(self, stamp_ns: int, velocities: NDArray[np.float64] | None) -> None:
        self._said_ns = self.now_ns
        told = np.zeros(0) if velocities is None else velocities
        self.joint_states.publish(JointState(Header.of(stamp_ns, ""), JOINTS, self._positions, told))
        wheels = zip(WHEELS, self._origins, self._positions.tolist(), strict=True)
        self.tf_out.publish(TFMessage(tuple(_turned(stamp_ns, *one) for one in wheels)))


def wheel_positions(ticks: WheelTicks, robot: Robot) -> NDArray[np.float64]:
    """(2,) radians of JOINTS."""
    counts = {"left": ticks.left, "right": ticks.right}
    return np.array([math.tau * counts[side] / robot.motor.ticks_per_turn for side in layout.SIDES])


def _turned(stamp_ns: int, link: str, origin: Vector3, angle: float) -> TransformStamped:
    """`base_link_T_wheel`: turned about the axle, which is y (REP-103: forward is positive)."""
    half = math.remainder(angle, 2.0 * math.tau) / 2.0
    turn = Quaternion(0.0, math.sin(half), 0.0, math.cos(half))
    return TransformStamped(Header.of(stamp_ns, "base_link"), link, Transform(origin, turn))
