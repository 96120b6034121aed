"""Nodes on a loop with simulated time, started with given restored messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from chefbot.delivery.drive_retry import NO_NAVIGATOR
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import (
    DeliveryStatus,
    Place,
    Places,
)
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped, Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import (
    BackUp,
    BackUp_Goal,
    DriveOnHeading,
    DriveOnHeading_Goal,
    FollowPath,
    FollowPath_Goal,
    NavigateToPose,
    NavigateToPose_Goal,
    NavigateToPose_Result,
    Spin,
    Spin_Goal,
)
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.robot.load import load_robot
from chefbot.runtime.actions import action_server
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import RESTORED_PREFIX, In, Node, NoParams, Out
from chefbot.runtime.node_container import NodeContainer

ROBOT = load_robot("chefbot_lidar")
ROOM = {"home": 0.0, "kitchen": 1.0, "table_1": 2.0, "table_2": 3.0}


class Driver(Node):
    """A navigator that takes 2 s to everywhere and records where; its first `fails` goals fail."""

    params: NoParams
    navigate_to_pose = action_server(NavigateToPose)
    fails = 0

    def start(self) -> None:
        self.driven: list[float] = []

    async def on_navigate_to_pose(self, goal: NavigateToPose_Goal, _: Any) -> NavigateToPose_Result:
        self.driven.append(goal.pose.pose.position.x)
        if len(self.driven) <= type(self).fails:
            return NavigateToPose_Result(NO_NAVIGATOR, "nobody answered")
        await self.sleep(2.0)
        return NavigateToPose_Result()


class People(Node):
    """Load and take the food 2 s after the robot has come, if it is still there."""

    params: NoParams
    delivery_status: In[DeliveryStatus]
    loaded: Out[Empty]
    taken: Out[Empty]

    def on_delivery_status(self, status: DeliveryStatus) -> None:
        if status.state in ("loading", "waiting"):
            self.spawn(self._press(status))

    async def _press(self, status: DeliveryStatus) -> None:
        await self.sleep(2.0)
        if self.delivery_status.last is status:
            (self.loaded if status.state == "loading" else self.taken).publish(Empty())


class Life:
    """Nodes on a loop that start with `words` as the restored messages of their predecessors."""

    def __init__(
        self, kinds: dict[str, str], words: dict[str, Message], params: dict[str, Any] | None = None
    ) -> None:
        self.system = NodeContainer(Loop(StepClock()), ROBOT, 1)
        self.said: list[Publication] = []
        self.loop = self.system.loop
        self.loop.add_observer(self.said.append)
        nodes = {
            name: NodeEntry(kind=kind, params=(params or {}).get(name, {})) for name, kind in kinds.items()
        }
        self.system.launch(Launch(name="restarted", description="", args={}, nodes=nodes))
        for topic, word in words.items():
            self.loop.publish(RESTORED_PREFIX + topic, word, "wire", from_device=True)
        places = tuple(
            Place(name, PoseStamped(Header(), Pose.of(SE2(x, 0.0, 0.0)))) for name, x in ROOM.items()
        )
        self.loop.publish("places", Places(places), "wire")

    def run(self, seconds: float) -> None:
        self.loop.run(until_ns=self.loop.now_ns + round(seconds * 1e9))

    def heard(self, topic: str) -> list[Any]:
        return [one.message for one in self.said if one.topic == topic]


AHEAD = PoseStamped(Header.of(0, "odom"), Pose.of(SE2(1.0, 0.0, 0.0)))


ORDERS: dict[str, tuple[Any, Any]] = {
    "spin": (Spin, Spin_Goal(3.0, Duration.of(30.0))),
    "drive_on_heading": (DriveOnHeading, DriveOnHeading_Goal(Point(0.5), 0.1, Duration.of(30.0))),
    "backup": (BackUp, BackUp_Goal(Point(-0.5), 0.1, Duration.of(30.0))),
    "follow_path": (FollowPath, FollowPath_Goal(Path(Header.of(0, "odom"), (AHEAD, AHEAD)))),
    "navigate_to_pose": (NavigateToPose, NavigateToPose_Goal(AHEAD)),
}


class Robot(Life):
    """Base, controller and navigator of a robot that stays at the origin for any command."""

    def __init__(self) -> None:
        kinds = {
            "base": "drive_base:DriveBaseNode",
            "controller": "controller:ControllerNode",
            "navigator": "navigator:NavigatorNode",
        }
        nodes = {name: f"chefbot.nodes.{kind}" for name, kind in kinds.items()}
        super().__init__({**nodes, "sensors": "tests.nodes.sensors:ClearSensorsNode"}, {})
        for parent, child in (("map", "odom"), ("odom", "base_footprint"), ("base_footprint", "base_link")):
            here = TransformStamped.of(0, parent, child, SE2(0.0, 0.0, 0.0))
            self.loop.publish("tf_static", TFMessage((here,)), "test")
        self.run(1.0)

    def order(self, name: str) -> None:
        action, goal = ORDERS[name]
        key = UUID(np.arange(16, dtype=np.uint8))
        self.loop.publish(f"{name}/_action/send_goal", action.send_goal(key, goal), "somebody")

    def press(self, word: bool) -> None:
        self.loop.publish("stop_request", Bool(word), "page")
        self.run(0.0)

    def outcomes(self, name: str) -> list[Any]:
        return self.heard(f"{name}/_action/get_result")

    def wants(self) -> bool:
        """Whether anything was commanded in the next second."""
        count = len(self.said)
        self.run(1.0)
        twists = [one.message for one in self.said[count:] if isinstance(one.message, Twist)]
        assert twists, "the base publishes all the time"
        return any(one.linear.x or one.angular.z for one in twists)


def ordered(robot: Robot, name: str, goal: object, seconds: float = 2.0) -> None:
    """Send `goal` to the action of that name and run for `seconds`."""
    action, before = ORDERS[name]
    ORDERS[name] = action, goal
    try:
        robot.order(name)
    finally:
        ORDERS[name] = action, before
    robot.run(seconds)


def speeds(robot: Robot) -> list[float]:
    """Linear speeds that navigation commanded, m/s."""
    return [
        one.message.linear.x
        for one in robot.said
        if one.topic == "cmd_vel_nav" and isinstance(one.message, Twist)
    ]
