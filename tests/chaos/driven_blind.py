"""A simulated robot that drives straight on at full speed while something happens to one of its sensors."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import msgspec
import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, Twist
from chefbot.msgs.nav2_msgs import FollowPath, FollowPath_Goal
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_speed
from chefbot.robot.spec import Robot
from chefbot.ros2.rmw.action_client import new_goal_id
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.load import load_any_world
from chefbot.sim.world.shapes import clearance

STEP_NS = 20_000_000
AHEAD, SIDE = 0.75, 0.33
"""Metres from the robot's middle to that of the box, and so far beside the way: outside the ranger's cone."""
WAY = 2.4
"""Metres of path."""
NODES = {
    "simulator": "chefbot.sim.device:SimulatorDevice",
    "frames": "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode",
    "odometry": "chefbot.nodes.odometry:OdometryNode",
    "depth_to_scan": "chefbot.nodes.depth_to_scan:DepthToScanNode",
    "base": "chefbot.nodes.drive_base:DriveBaseNode",
    "controller": "chefbot.nodes.controller:ControllerNode",
}


def lidar_alone() -> Robot:
    """Neither camera nor ranger."""
    robot = load_robot("chefbot_lidar")
    sensors = msgspec.structs.replace(robot.sensors, depth_camera=None, ultrasonic=None)
    return msgspec.structs.replace(robot, name="lidar_alone", sensors=sensors)


ROBOTS = {
    "chefbot": load_robot("chefbot"),
    "chefbot_lidar": load_robot("chefbot_lidar"),
    "lidar": lidar_alone(),
}


def sensors_of(robot: Robot) -> list[str]:
    """The topics that a fault can befall."""
    names = {"scan": robot.sensors.lidar, "depth": robot.sensors.depth_camera}
    return [name for name, sensor in names.items() if sensor is not None]


def free_ways(world: str, count: int, seed: int) -> list[SE2]:
    """Poses from which the floor is free for 3 m straight ahead, for half a metre to either side."""
    known, rng = load_any_world(world, ROBOTS["chefbot"]), np.random.default_rng(seed)
    solids = list(known.static)
    found: list[SE2] = []
    corners = np.array([[place.x, place.y] for place in known.places.values()])
    low, high = corners.min(0) - 2.0, corners.max(0) + 2.0
    while len(found) < count:
        x, y = rng.uniform(low, high).tolist()
        pose = SE2(x, y, float(rng.uniform(-math.pi, math.pi)))
        points = [pose @ SE2(d, 0.0, 0.0) for d in np.arange(0.0, 3.2, 0.1).tolist()]
        if all(clearance(solids, p.x, p.y, 0.0, 0.7) > 0.5 for p in points):
            found.append(pose)
    return found


class Outcome(NamedTuple):
    """What came of one run; contact: the robot's greatest speed, m/s, when it touched something, 0 without."""

    contact: float
    stood_after: float
    """Seconds from the fault to the first commanded twist of zero that was not followed by another; inf: never."""
    description: str
    status: int
    """Of the action, 0 while it goes on."""


class BlindDrive:
    """One robot with its controller in a world; `topic(name)` are the messages there since the start."""

    def __init__(
        self, robot: Robot, at: SE2 | None, world: str = "hotel", profile: str = "real", seed: int = 1
    ):
        self.system = NodeContainer(Loop(StepClock()), robot, seed)
        self.loop = self.system.loop
        self.published: list[Publication] = []
        self.loop.add_observer(self._keep)
        params: dict[str, Any] = {"world": world, "profile": profile, "people": 0, "picture_hz": 0}
        nodes = {name: NodeEntry(kind=kind) for name, kind in NODES.items()}
        nodes["simulator"] = NodeEntry(kind=NODES["simulator"], params=params)
        self.system.launch(Launch(name="driven", description="", args={}, nodes=nodes))
        simulator: Any = self.system.nodes["simulator"]
        self.simulation: Simulation = simulator.simulation
        if at is not None:
            self.simulation.kidnap(at)
        self.contact = 0.0
        self.run(1.0)

    def _keep(self, publication: Publication) -> None:
        if publication.topic in ("cmd_vel_nav", "controller/standing", "follow_path/_action/get_result"):
            self.published.append(publication)

    def topic(self, name: str) -> list[Any]:
        """Messages so far."""
        return [one.message for one in self.published if one.topic == name]

    def run(self, seconds: float) -> None:
        """Also notes how fast the robot is when it touches something."""
        until = self.loop.now_ns + round(seconds * 1e9)
        while self.loop.now_ns < until:
            before = abs(self.simulation.truth().v)
            self.loop.run(until_ns=min(until, self.loop.now_ns + STEP_NS))
            if self.simulation.touching:
                self.contact = max(self.contact, before)

    def go(self, way: float = WAY) -> None:
        """Straight ahead."""
        start = self.system.transforms.lookup("odom", "base_link")
        poses = [start @ SE2(d, 0.0, 0.0) for d in np.arange(0.0, way, 0.05).tolist()]
        path = Path(
            Header.of(0, "odom"), tuple(PoseStamped(Header.of(0, "odom"), Pose.of(one)) for one in poses)
        )
        goal = FollowPath.send_goal(new_goal_id(), FollowPath_Goal(path))
        self.loop.publish("follow_path/_action/send_goal", goal, "test")

    def go_at_full_speed(self) -> None:
        """Returns when it does."""
        self.go()
        for _ in range(60):
            self.run(0.1)
            if self.simulation.truth().v > 0.9 * max_speed(self.system.robot):
                return
        raise AssertionError("it does not get on")

    def fault(self, fault: str, sensor: str) -> None:
        """Such as "freeze", "scan"."""
        self.loop.publish("simulation/sensor_fault", String(f"{fault} {sensor}"), "test", from_device=True)
        self.run(0.0)

    def drop_box(self, ahead: float = AHEAD, side: float = 0.0) -> None:
        """Before the robot, where it is now."""
        at = self.simulation.truth().pose @ SE2(ahead, side, 0.0)
        self.simulation.drop_box(at.x, at.y, (0.3, 0.3, 0.5))

    @property
    def standing(self) -> str:
        """Why it stands, empty if it does not."""
        told = self.topic("controller/standing")
        return told[-1].data if told else ""

    @property
    def status(self) -> int:
        """Of the order, 0 while it goes on."""
        ended = self.topic("follow_path/_action/get_result")
        return ended[-1].status if ended else 0

    def seconds_to_stand(self, since_ns: int) -> float:
        """From then to the twist of zero after which there was no other."""
        moving = [
            one.time_ns
            for one in self.published
            if isinstance(one.message, Twist) and (one.message.linear.x or one.message.angular.z)
        ]
        return max(0.0, (moving[-1] + 100_000_000 - since_ns) / 1e9)


def drive_into(robot: Robot, at: SE2, fault: str, sensor: str, side: float, seed: int = 1) -> Outcome:
    """At full speed the fault begins, and half a second later a box is set down before the robot."""
    drive = BlindDrive(robot, at, seed=seed)
    drive.go_at_full_speed()
    began = drive.loop.now_ns
    drive.fault(fault, sensor)
    drive.run(0.5)
    drive.drop_box(side=side)
    drive.run(4.0)
    outcome = Outcome(drive.contact, drive.seconds_to_stand(began), drive.standing, drive.status)
    drive.system.stop()
    return outcome


TITLES = {"scan": "lidar", "depth": "depth camera"}
CONTACT = 0.05
"""m/s; slower is no hit."""


def side_of(place: int) -> float:
    """Straight ahead, and outside the ranger's cone to either side."""
    return (0.0, SIDE, -SIDE)[place % 3]
