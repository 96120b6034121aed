"""Simulated drives that the collision monitor checks: dropped boxes, faults of sensors, random teleoperation."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import String
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot
from chefbot.sim.world.load import load_any_world
from chefbot.sim.world.shapes import clearance
from tests.chaos.sensor_fault_drive import ROBOTS, SensorFaultDrive

FAULTS = (
    "none", "stop", "freeze", "late", "half_blind", "noise share=0.3", "offset yaw=0.3", "offset range=0.3",
    "upside_down", "jump clock=5", "jump clock=-5", "stop ultrasonic", "freeze ultrasonic",
)  # fmt: skip
"""No fault, and twelve faults: of the main obstacle sensor (lidar, else depth camera) unless a sensor is named."""
BOX = (0.3, 0.3, 0.5)
TELEOP_PERIOD = 0.1
CREEP = 0.05
"""Speed of a contact that harms nobody, m/s."""
ALL_ROBOTS = {**ROBOTS, "jackal": load_robot("jackal")}
PLACES = ("ahead", "side", "behind", "above")
OVERLAP = 0.15
"""Height by which a board that hangs reaches below the top of the robot, m."""


def main_sensor(robot: Robot) -> str:
    """Return the name in the simulator of the sensor that sees obstacles."""
    return "lidar" if robot.sensors.lidar is not None else "depth_camera"


def can_know(robot: Robot, fault: str, place: str) -> bool:
    """Return whether a sensor of the robot, with this fault, measures the box where it is.

    A lidar sees one plane, below a board that hangs. Nothing but the camera, which looks ahead, contradicts a lidar
    whose ranges are too long.
    """
    if robot.sensors.lidar is None:
        return True
    sees_ahead_only = fault == "offset range=0.3"
    if robot.sensors.depth_camera is None:
        return place != "above" and not sees_ahead_only
    return place in ("ahead", "above") or not sees_ahead_only


def request_of(fault: str, robot: Robot) -> str:
    """Return the request of a fault for the simulator; empty for none or if the robot has no such sensor."""
    kind, _, rest = fault.partition(" ")
    if kind == "none" or ("ultrasonic" in rest and robot.sensors.ultrasonic is None):
        return ""
    if kind == "jump":
        return f"jump {main_sensor(robot)} seconds={rest.removeprefix('clock=')}"
    return f"{kind} {rest}" if rest == "ultrasonic" else f"{kind} {main_sensor(robot)} {rest}".strip()


def free_starts(world: str, robot: Robot, count: int, seed: int) -> list[SE2]:
    """Return random poses with a free gap of 5 cm around the robot."""
    loaded, rng = load_any_world(world, robot), np.random.default_rng(seed)
    solids = list(loaded.shapes_at_rest())
    corners = np.array([[place.x, place.y] for place in loaded.places.values()])
    low, high = corners.min(0) - 2.0, corners.max(0) + 2.0
    found: list[SE2] = []
    while len(found) < count:
        x, y = rng.uniform(low, high).tolist()
        if clearance(solids, x, y, 0.0, 0.7) > robot.circumscribed_radius + 0.05:
            found.append(SE2(x, y, float(rng.uniform(-math.pi, math.pi))))
    return found


class DriveOutcome(NamedTuple):
    """The highest speed of a contact, m/s; metres driven; the reasons that were published; what was touched."""

    contact: float
    metres: float
    reasons: tuple[str, ...]
    touched: tuple[str, ...]


class MonitoredDrive(SensorFaultDrive):
    """A robot that somebody drives without looking; it keeps what the collision monitor publishes."""

    def __init__(self, robot: Robot, at: SE2, world: str = "hotel", seed: int = 1) -> None:
        self.reasons: list[tuple[int, str]] = []
        self.wheels: list[tuple[int, float]] = []
        self.touched: set[str] = set()
        self._poses: list[SE2] = []
        super().__init__(robot, at, world, seed=seed)
        self.loop.subscribe("collision_monitor/reason", "test", self._keep_reason)
        self.loop.subscribe("wheel_speeds", "test", self._keep_wheels)

    def _keep_reason(self, message: object) -> None:
        assert isinstance(message, String)
        self.reasons.append((self.loop.now_ns, message.data))

    def _keep_wheels(self, message: object) -> None:
        self.wheels.append((self.loop.now_ns, abs(message.left) + abs(message.right)))  # type: ignore[attr-defined]

    def hold(self, v: float, w: float, seconds: float, topic: str = "cmd_vel_teleop") -> None:
        """Command a twist (m/s, rad/s) ten times a second."""
        for _ in range(max(1, round(seconds / TELEOP_PERIOD))):
            self.loop.publish(topic, Twist.of(v, w), "test")
            self.run(TELEOP_PERIOD)
            self._poses.append(self.simulation.truth().pose)
            self.touched |= set(self.simulation.touching)

    def request_fault(self, request: str) -> None:
        """Begin a fault of the simulator."""
        self.loop.publish("simulation/fault", String(request), "test", from_device=True)
        self.run(0.0)

    @property
    def outcome(self) -> DriveOutcome:
        """The result so far."""
        metres = sum(a.distance(b) for a, b in pairwise(self._poses))
        reasons = tuple(dict.fromkeys(text for _, text in self.reasons if text))
        return DriveOutcome(self.contact, metres, reasons, tuple(sorted(self.touched)))


def random_teleop(robot: Robot, world: str, seed: int, segments: int = 5) -> DriveOutcome:
    """Drive at random for some seconds, forwards, backwards and in arcs, as somebody does who does not look."""
    rng, limits = np.random.default_rng(seed), Limits.of(robot)
    drive = MonitoredDrive(robot, free_starts(world, robot, 1, seed)[0], world, seed)
    for _ in range(segments):
        v = float(rng.uniform(-1.0, 1.0)) * limits.speed
        w = float(rng.uniform(-1.0, 1.0) * rng.integers(0, 2)) * limits.angular_speed
        drive.hold(v, w, float(rng.uniform(1.0, 4.0)))
    drive.system.stop()
    return drive.outcome


def dropped_box(robot: Robot, at: SE2, fault: str, place: str, seed: int) -> DriveOutcome:
    """Begin a fault at full speed, set a box down half a second later, and go on for some seconds.

    The box is where the robot can stop before it: a stopping distance and 0.3 m ahead, on the floor or hanging at the
    height of the robot's top; or beside it, and it turns towards it; or behind it, and it backs up.
    """
    limits, drive = Limits.of(robot), MonitoredDrive(robot, at, seed=seed)
    speed = min(limits.speed, 0.7)
    drive.hold(speed, 0.0, 2.0)
    request = request_of(fault, robot)
    if request:
        drive.request_fault(request)
    drive.hold(speed, 0.0, 0.5)
    _drop(drive, place, speed, limits)
    twist = {"side": (0.5 * speed, 0.8), "behind": (-speed, 0.0)}.get(place, (speed, 0.0))
    drive.hold(*twist, 4.0)
    drive.hold(0.0, 0.0, 0.5)
    drive.hold(*twist, 3.0)  # after the stick was let go
    drive.system.stop()
    return drive.outcome


def _drop(drive: MonitoredDrive, place: str, speed: float, limits: Limits) -> None:
    body = drive.system.robot.circumscribed_radius + BOX[0] / 2
    ahead = body + 0.3 + speed * 0.3 + speed * speed / limits.acceleration
    x, y = {"side": (0.15, body + 0.25), "behind": (-body - 0.3, 0.0)}.get(place, (ahead, 0.0))
    bottom = overall_height(drive.system.robot) - OVERLAP if place == "above" else 0.0
    pose = drive.simulation.truth().pose @ SE2(x, y, 0.0)
    try:
        drive.simulation.drop_box(pose.x, pose.y, BOX, bottom)
    except UserError:
        return  # it would lie on a person
