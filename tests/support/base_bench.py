"""The drive base alone: a robot that moves as its wheels are commanded, walls, and sensors that can be silent."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.geometry_msgs import TransformStamped, Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import RESTORED_PREFIX
from chefbot.runtime.node_container import NodeContainer

LIDAR_ROBOT = load_robot("chefbot_lidar")
NO_SENSORS = {"optional_sensors": ["lidar", "depth camera", "ultrasonic ranger"]}
TICK = 0.05
"""Period of the odometry and of the commands, s; the sensors send at half that rate."""
BEAMS, BINS = 360, 160


class BaseBench:
    """A drive base on a loop with simulated time.

    `wall`: distance along x in odom of a wall across the path ahead. `silent`: names of sensors that send nothing.
    `lag`: ticks by which the robot follows its commands later. Without `sensors` nothing but commands arrives.
    """

    def __init__(
        self, robot: Robot = LIDAR_ROBOT, *, sensors: bool = True, restored: dict[str, Message] | None = None,
        **params: Any,
    ) -> None:  # fmt: skip
        self.robot, self.sensors, self.wall, self.lag = robot, sensors, math.inf, 1
        self.silent: set[str] = set()
        self.pose, self.pose_delay = SE2(0.0, 0.0, 0.0), 0.0
        self.echo = math.inf
        self.rng = np.random.default_rng(3)
        self.published: list[Publication] = []
        self.system = NodeContainer(Loop(StepClock()), robot, 1)
        self.loop = self.system.loop
        self.loop.add_observer(self.published.append)
        given = params if sensors else {"monitor": NO_SENSORS, **params}
        entry = NodeEntry(kind="chefbot.nodes.drive_base:DriveBaseNode", params=given)
        self.system.launch(Launch(name="bench", description="", args={}, nodes={"base": entry}))
        for topic, message in (restored or {}).items():
            self.loop.publish(RESTORED_PREFIX + topic, message, "wire", from_device=True)
        self._ticks = 0
        self.run(0.0)

    @property
    def node(self) -> Any:
        return self.system.nodes["base"]

    # -- what happens

    def run(self, seconds: float, topic: str = "", v: float = 0.0, w: float = 0.0) -> None:
        """Run for some time, while a twist is sent again and again on a topic, if one is named."""
        if seconds == 0.0:
            self.loop.run(until_ns=self.loop.now_ns)
        for _ in range(round(seconds / TICK)):
            if topic:
                self.loop.publish(topic, Twist.of(v, w), "client")
            if self.sensors:
                self._move()
                self._send_sensors()
            self._ticks += 1
            self.loop.run(until_ns=round(self._ticks * TICK * 1e9))

    def send(self, topic: str, message: Message) -> None:
        """Publish a message and let it be handled, before time goes on."""
        self.loop.publish(topic, message, "client")
        self.run(0.0)

    def twist(self, topic: str, v: float, w: float = 0.0) -> None:
        self.send(topic, Twist.of(v, w))

    def _move(self) -> None:
        twists = [one.message for one in self.published if one.topic == "cmd_vel"]
        if len(twists) >= self.lag:
            twist: Any = twists[-self.lag]
            self.pose = self.pose @ SE2(twist.linear.x * TICK, 0.0, twist.angular.z * TICK)

    def _send_sensors(self) -> None:
        now_ns = self.loop.now_ns
        if "odometry" not in self.silent:
            stamp = now_ns - round(self.pose_delay * 1e9)
            self.loop.publish(
                "tf", TFMessage((TransformStamped.of(stamp, "odom", "base_link", self.pose),)), "odometry"
            )
        if self._ticks % 2:
            return
        header = Header.of(now_ns, "base_link")
        if "lidar" not in self.silent:
            angles = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
            ranges = self._distances(angles) + 0.003 * self.rng.standard_normal(BEAMS)
            limits = (0.0, 0.1, 0.16, 8.0)
            step = 2.0 * math.pi / BEAMS
            scan = LaserScan(header, -math.pi, math.pi - step, step, *limits, ranges.astype(np.float32))
            self.loop.publish("scan", scan, "lidar")
        if "depth camera" not in self.silent:
            angles = np.linspace(-0.5, 0.5, BINS)
            ranges = self._distances(angles) + 0.003 * self.rng.standard_normal(BINS)
            clear_to = np.minimum(ranges - 0.05, 4.0)
            floor = np.full(BINS, 0.4, np.float32), np.maximum(clear_to, 0.41).astype(np.float32)
            step = float(angles[1] - angles[0])
            scan = ObstacleScan(header, -0.5, step, 8.0, ranges.astype(np.float32), *floor)
            self.loop.publish("obstacles", scan, "camera")
        if "ultrasonic ranger" not in self.silent:
            self.loop.publish("ultrasonic", Range(header, 0, 0.5, 0.02, 4.0, self.echo), "board")

    def _distances(self, angles: np.ndarray) -> np.ndarray:
        """Return the distances of the wall ahead in some directions from base_link, else those of a round hall."""
        gap, heading = self.wall - self.pose.x, np.cos(angles + self.pose.yaw)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.minimum(np.where(heading > 0.05, gap / heading, 5.0), 5.0)

    # -- what comes of it

    def messages(self, topic: str) -> list[Any]:
        return [one.message for one in self.published if one.topic == topic]

    def texts(self, topic: str) -> list[str]:
        return [message.data for message in self.messages(topic) if isinstance(message, (String, Bool))]

    @property
    def twist_out(self) -> tuple[float, float]:
        """The last twist that was commanded to the wheels."""
        last = self.messages("cmd_vel")[-1]
        return last.linear.x, last.angular.z

    @property
    def speed(self) -> float:
        return self.twist_out[0]
