"""Runs nodes on a loop with simulated time, with restored messages as after a restart."""

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
from chefbot.robot.spec import Robot
from chefbot.runtime.actions import action_server
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import RESTORED_PREFIX, In, Node, NoParams, Out
from chefbot.runtime.node_container import NodeContainer

ROBOT = load_robot("chefbot_lidar")
ALL_SENSORS = ["lidar", "depth camera", "ultrasonic ranger"]
WITHOUT_SENSORS = {"monitor": {"optional_sensors": ALL_SENSORS}}
"""Parameters of a drive base to which no sensor is connected."""
ROOM = {"home": 0.0, "kitchen": 1.0, "table_1": 2.0, "table_2": 3.0}


class FakeNavigator(Node):
    """Reaches each goal after 2 s and records it; the first `fails` goals fail."""

    params: NoParams
    navigate_to_pose = action_server(NavigateToPose)
    fails = 0

    def start(self) -> None:
        self.goals: list[float] = []

    async def on_navigate_to_pose(self, goal: NavigateToPose_Goal, _: Any) -> NavigateToPose_Result:
        self.goals.append(goal.pose.pose.position.x)
        if len(self.goals) <= type(self).fails:
            return NavigateToPose_Result(NO_NAVIGATOR, "no navigator")
        await self.sleep(2.0)
        return NavigateToPose_Result()


class FakeStaff(Node):
    """Confirms loading and taking of the food 2 s after the robot has arrived, if it is still there."""

    params: NoParams
    delivery_status: In[DeliveryStatus]
    loaded: Out[Empty]
    taken: Out[Empty]

    def on_delivery_status(self, status: DeliveryStatus) -> None:
        if status.state in ("loading", "waiting", "unloading"):
            self.spawn(self._confirm(status))

    async def _confirm(self, status: DeliveryStatus) -> None:
        await self.sleep(2.0)
        if self.delivery_status.last is status:
            (self.loaded if status.state == "loading" else self.taken).publish(Empty())


class NodeRunner:
    """Nodes on a loop with simulated time that start with the messages `restored`, by topic."""

    def __init__(
        self,
        kinds: dict[str, str],
        restored: dict[str, Message],
        params: dict[str, Any] | None = None,
        robot: Robot = ROBOT,
    ) -> None:
        self.system = NodeContainer(Loop(StepClock()), robot, 1)
        self.published: list[Publication] = []
        self.loop = self.system.loop
        self.loop.add_observer(self.published.append)
        nodes = {
            name: NodeEntry(kind=kind, params=(params or {}).get(name, {})) for name, kind in kinds.items()
        }
        self.system.launch(Launch(name="restarted", description="", args={}, nodes=nodes))
        for topic, message in restored.items():
            self.loop.publish(RESTORED_PREFIX + topic, message, "wire", from_device=True)
        places = tuple(
            Place(name, PoseStamped(Header(), Pose.of(SE2(x, 0.0, 0.0)))) for name, x in ROOM.items()
        )
        self.loop.publish("places", Places(places), "wire")

    def run(self, seconds: float) -> None:
        self.loop.run(until_ns=self.loop.now_ns + round(seconds * 1e9))

    def messages(self, topic: str) -> list[Any]:
        return [item.message for item in self.published if item.topic == topic]


AHEAD = PoseStamped(Header.of(0, "odom"), Pose.of(SE2(1.0, 0.0, 0.0)))


GOALS: dict[str, tuple[Any, Any]] = {
    "spin": (Spin, Spin_Goal(3.0, Duration.of(30.0))),
    "drive_on_heading": (DriveOnHeading, DriveOnHeading_Goal(Point(0.5), 0.1, Duration.of(30.0))),
    "backup": (BackUp, BackUp_Goal(Point(-0.5), 0.1, Duration.of(30.0))),
    "follow_path": (FollowPath, FollowPath_Goal(Path(Header.of(0, "odom"), (AHEAD, AHEAD)))),
    "navigate_to_pose": (NavigateToPose, NavigateToPose_Goal(AHEAD)),
}


class StationaryRobot(NodeRunner):
    """Base, controller and navigator of a robot that does not move, whatever is commanded."""

    fixed = (("map", "odom"), ("odom", "base_footprint"), ("base_footprint", "base_link"))
    """Frames that do not move in their parents."""

    def __init__(self, robot: Robot = ROBOT) -> None:
        kinds = {
            "base": "drive_base:DriveBaseNode",
            "controller": "controller:ControllerNode",
            "navigator": "navigator:NavigatorNode",
        }
        nodes = {name: f"chefbot.nodes.{kind}" for name, kind in kinds.items()}
        nodes["sensors"] = "tests.nodes.clear_sensors:ClearSensorsNode"
        super().__init__(nodes, {}, robot=robot)
        for parent, child in self.fixed:
            transform = TransformStamped.of(0, parent, child, SE2(0.0, 0.0, 0.0))
            self.loop.publish("tf_static", TFMessage((transform,)), "test")
        self.run(1.0)

    def send_goal(self, name: str) -> None:
        action, goal = GOALS[name]
        goal_id = UUID(np.arange(16, dtype=np.uint8))
        self.loop.publish(f"{name}/_action/send_goal", action.send_goal(goal_id, goal), "client")

    def request_stop(self, stop: bool) -> None:
        self.loop.publish("stop_request", Bool(stop), "web_ui")
        self.run(0.0)

    def results(self, name: str) -> list[Any]:
        return self.messages(f"{name}/_action/get_result")

    def commands_motion(self) -> bool:
        """Run for a second and return whether a velocity other than zero was commanded."""
        count = len(self.published)
        self.run(1.0)
        twists = [item.message for item in self.published[count:] if isinstance(item.message, Twist)]
        assert twists, "the base publishes commands at any time"
        return any(twist.linear.x or twist.angular.z for twist in twists)


def send_goal_and_run(robot: StationaryRobot, name: str, goal: object, seconds: float = 2.0) -> None:
    """Send `goal` to the action of that name and run for `seconds`."""
    action, before = GOALS[name]
    GOALS[name] = action, goal
    try:
        robot.send_goal(name)
    finally:
        GOALS[name] = action, before
    robot.run(seconds)


def commanded_speeds(robot: StationaryRobot) -> list[float]:
    """Return the linear velocities that navigation has commanded, m/s."""
    return [
        item.message.linear.x
        for item in robot.published
        if item.topic == "cmd_vel_nav" and isinstance(item.message, Twist)
    ]
