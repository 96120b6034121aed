"""Simulated drives straight ahead at full speed during which one of the sensors fails."""

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
"""Position of the box in base_link, metres; at SIDE it is outside the cone of the ultrasonic sensor."""
PATH_LENGTH = 2.4
"""Metres."""
NODES = {
    "simulator": "chefbot.sim.device:SimulatorDevice",
    "robot_state_publisher": "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode",
    "odometry": "chefbot.nodes.odometry:OdometryNode",
    "depth_to_scan": "chefbot.nodes.cameras.depth_to_scan:DepthToScanNode",
    "base": "chefbot.nodes.drive_base:DriveBaseNode",
    "controller": "chefbot.nodes.controller:ControllerNode",
}


def robot_with_lidar_only() -> Robot:
    """Return a robot without depth camera and ultrasonic sensor."""
    robot = load_robot("chefbot_lidar")
    sensors = msgspec.structs.replace(robot.sensors, depth_camera=None, ultrasonic=None)
    return msgspec.structs.replace(robot, name="lidar_alone", sensors=sensors)


ROBOTS = {
    "chefbot": load_robot("chefbot"),
    "chefbot_lidar": load_robot("chefbot_lidar"),
    "lidar": robot_with_lidar_only(),
}


def sensors_of(robot: Robot) -> list[str]:
    """Return the topics of the sensors that the simulator can let fail."""
    names = {"scan": robot.sensors.lidar, "depth": robot.sensors.depth_camera}
    return [name for name, sensor in names.items() if sensor is not None]


def straight_free_starts(world: str, count: int, seed: int) -> list[SE2]:
    """Return random poses with free floor for 3 m straight ahead and 0.5 m to either side."""
    loaded, rng = load_any_world(world, ROBOTS["chefbot"]), np.random.default_rng(seed)
    solids = list(loaded.static)
    found: list[SE2] = []
    corners = np.array([[place.x, place.y] for place in loaded.places.values()])
    low, high = corners.min(0) - 2.0, corners.max(0) + 2.0
    while len(found) < count:
        x, y = rng.uniform(low, high).tolist()
        pose = SE2(x, y, float(rng.uniform(-math.pi, math.pi)))
        points = [pose @ SE2(d, 0.0, 0.0) for d in np.arange(0.0, 3.2, 0.1).tolist()]
        if all(clearance(solids, p.x, p.y, 0.0, 0.7) > 0.5 for p in points):
            found.append(pose)
    return found


class Outcome(NamedTuple):
    """The result of one drive."""

    contact: float
    """Highest speed at which the robot touched something, m/s; 0 without contact."""
    stopped_after: float
    """Seconds from the fault to the last commanded twist that was not zero."""
    stood_after: float
    """Seconds from the fault until the robot stood for good."""
    description: str
    status: int
    """Status of the action; 0 while it is active."""


class SensorFaultDrive:
    """A robot with its controller in a simulated world that follows a straight path while a sensor fails."""

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
        self.contact, self.last_motion_ns = 0.0, 0
        self.run(1.0)

    def _keep(self, publication: Publication) -> None:
        if publication.topic in ("cmd_vel_nav", "controller/wait_reason", "follow_path/_action/get_result"):
            self.published.append(publication)

    def topic(self, name: str) -> list[Any]:
        """Return the messages published on a topic since the start."""
        return [item.message for item in self.published if item.topic == name]

    def run(self, seconds: float) -> None:
        """Run the simulation and record the speed at which the robot touches something, and when it moved last."""
        until = self.loop.now_ns + round(seconds * 1e9)
        while self.loop.now_ns < until:
            before = abs(self.simulation.truth().v)
            self.loop.run(until_ns=min(until, self.loop.now_ns + STEP_NS))
            if abs(self.simulation.truth().v) > STANDSTILL:
                self.last_motion_ns = self.loop.now_ns
            if self.simulation.touching:
                self.contact = max(self.contact, before)

    def follow_straight_path(self, length: float = PATH_LENGTH) -> None:
        """Send a goal to follow a path straight ahead of the robot."""
        start = self.system.transforms.lookup("odom", "base_link")
        poses = [start @ SE2(d, 0.0, 0.0) for d in np.arange(0.0, length, 0.05).tolist()]
        path = Path(
            Header.of(0, "odom"), tuple(PoseStamped(Header.of(0, "odom"), Pose.of(pose)) for pose in poses)
        )
        goal = FollowPath.send_goal(new_goal_id(), FollowPath_Goal(path))
        self.loop.publish("follow_path/_action/send_goal", goal, "test")

    def accelerate_to_full_speed(self) -> None:
        """Follow a straight path until the robot has 90 % of its maximum speed."""
        self.follow_straight_path()
        for _ in range(60):
            self.run(0.1)
            if self.simulation.truth().v > 0.9 * max_speed(self.system.robot):
                return
        raise AssertionError("the robot does not reach its maximum speed")

    def inject(self, fault: str, sensor: str) -> None:
        """Let a sensor fail: fault "stop", "freeze", "late", "half_blind" or "none"; sensor "scan" or "depth"."""
        request = String(f"{fault} {NAMES[sensor]}")
        self.loop.publish("simulation/fault", request, "test", from_device=True)
        self.run(0.0)

    def drop_box(self, ahead: float = AHEAD, side: float = 0.0) -> None:
        """Place a box at a position relative to the robot's pose, metres."""
        at = self.simulation.truth().pose @ SE2(ahead, side, 0.0)
        self.simulation.drop_box(at.x, at.y, (0.3, 0.3, 0.5))

    @property
    def wait_reason(self) -> str:
        """Return why the controller keeps the robot standing; empty if it does not."""
        published = self.topic("controller/wait_reason")
        return published[-1].data if published else ""

    @property
    def status(self) -> int:
        """Return the status of the action; 0 while it is active."""
        results = self.topic("follow_path/_action/get_result")
        return results[-1].status if results else 0

    def seconds_to_stop(self, since_ns: int) -> float:
        """Return the time from `since_ns` to the first twist of zero after the last that was not."""
        moving = [
            item.time_ns
            for item in self.published
            if isinstance(item.message, Twist) and (item.message.linear.x or item.message.angular.z)
        ]
        return max(0.0, (moving[-1] + 100_000_000 - since_ns) / 1e9)


def drive_with_fault(robot: Robot, at: SE2, fault: str, sensor: str, side: float, seed: int = 1) -> Outcome:
    """Let the sensor fail at full speed and place a box in front of the robot half a second later."""
    drive = SensorFaultDrive(robot, at, seed=seed)
    drive.accelerate_to_full_speed()
    began = drive.loop.now_ns
    drive.inject(fault, sensor)
    drive.run(0.5)
    drive.drop_box(side=side)
    drive.run(4.0)
    stood_after = (drive.last_motion_ns - began) / 1e9
    outcome = Outcome(
        drive.contact, drive.seconds_to_stop(began), stood_after, drive.wait_reason, drive.status
    )
    drive.system.stop()
    return outcome


NAMES = {"scan": "lidar", "depth": "depth_camera"}
TITLES = {"scan": "lidar", "depth": "depth camera"}
STANDSTILL = 0.02
"""Speed below which a robot stands, m/s: its body still rocks a little on its casters."""
CONTACT = 0.05
"""Lowest speed that counts as a collision, m/s."""


def box_offset(number: int) -> float:
    """Return the lateral offset of the box in drive `number`: straight ahead, left, right."""
    return (0.0, SIDE, -SIDE)[number % 3]
