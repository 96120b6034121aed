"""The simulated robot as a device: the same messages as the built one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from chefbot.devices.board_node import BoardNode
from chefbot.errors import UserError
from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.chefbot_msgs import Collision, WheelSpeeds
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
)
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import CameraInfo, Image, LaserScan
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.robot.sensors import Lidar
from chefbot.runtime.node import In, Out, every, topic
from chefbot.sim.board import Board
from chefbot.sim.depth_camera import DepthCameraWorker, DepthRenderer
from chefbot.sim.faults import FaultySensor, fault_named, faulty_camera, faulty_lidar
from chefbot.sim.rays import lidar_angles
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.load import is_own_map, load_any_world

BOARD_HZ = 50
"""The computer talks with the board so often; the rate of camera and lidar is rounded to a part of it."""
TRUTH_HZ = 10
HEALTH_HZ = 1
CAMERA_LATENCY_NS = 50_001_000
"""From exposure to delivery. The odd microsecond gives a frame an instant of its own: a log without pictures,
in which the scan speaks in their place, then has the same order."""
BOX = (0.4, 0.4, 0.5)
"""Sides in metres of a box that somebody drops."""

FAULTS = {
    "perfect": "without a robot's faults",
    "real": "with a real robot's faults",
    "assembled": "with the faults of a robot that was never calibrated",
}
"""Profile to words."""


class SimulatorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which world, how perfect."""

    world: Annotated[
        str, Meta(min_length=1, description="a world's name, a world file, or a ROS map.yaml")
    ] = "room"
    start: Annotated[
        str,
        Meta(
            description="'[x, y, yaw]' in the world's frame, m and rad; empty: the world's, or the most room of a map"
        ),
    ] = ""
    map: Annotated[
        str | None,
        Meta(
            description="the map that localization uses; empty: the world's own; none: it begins where the robot does"
        ),
    ] = None
    profile: Annotated[
        Literal["perfect", "real", "assembled"],
        Meta(
            description="without a robot's faults, with them, or with those of one that was never calibrated"
        ),
    ] = "real"
    people: Annotated[
        int, Meta(ge=-1, le=50, description="who walk about; -1: as many as the world says")
    ] = -1
    picture_hz: Annotated[float, Meta(ge=0, le=10, description="colour pictures for people, Hz; 0: none")] = (
        2.0
    )


class SimulatorDevice(BoardNode):
    """Physics, board and sensors. `ground_truth` is for scoring and the ghost on the page; no node reads it.

    Wheels, IMU, ultrasonic ranger and battery are on the motor board, and all of theirs goes as bytes through its
    firmware and the driver's half of the line, at the firmware's rates.
    The frame `map` of the truth begins where the robot stands at the start, as a mapper's does; where the world is
    made of the very map that localization uses, it is that map's.
    """

    live_params = ("picture_hz",)
    params: SimulatorParams
    drop_box: In[PoseStamped] = topic("simulation/drop_box")
    door: In[String] = topic("simulation/door")
    kidnap: In[PoseStamped] = topic("simulation/kidnap")
    sensor_fault: In[String] = topic("simulation/sensor_fault")
    scan: Out[LaserScan]
    depth: Out[Image] = topic("camera/depth/image_raw")
    camera_info: Out[CameraInfo] = topic("camera/depth/camera_info")
    picture: Out[Image] = topic("camera/color/image_raw")
    ground_truth: Out[Odometry]
    collision: Out[Collision]
    remark: Out[String] = topic("simulation/remark")

    def start(self) -> None:
        """Build the world; physics time begins now."""
        world = load_any_world(self.params.world, self.robot, self.params.start)
        people = None if self.params.people < 0 else self.params.people
        seed = int(self.context.rng().integers(2**31))
        self.simulation = Simulation(self.robot, world, self.params.profile, seed, people=people)
        self._board = Board(self.robot, self.simulation, self.now_ns)
        localizes_on = self.params.map
        own = localizes_on is not None and is_own_map(self.params.world, localizes_on)
        self._origin = IDENTITY if own else self.simulation.truth().pose
        self._pressed = False
        self._tick = 0
        self._frames = 0
        self._collisions = 0
        self._remarks: list[str] = []
        rng = self.context.rng().spawn(1)[0]
        self._lidar_line = faulty_lidar(self.scan.publish, rng)
        self._camera_line = faulty_camera(self.depth.publish, rng)
        self._start_camera(seed)
        if self.robot.sensors.lidar is None:
            self.scan.withdraw()
        names = f"robot {self.robot.name} in world {world.name}, {FAULTS[self.params.profile]}"
        self.announcement = f"Simulated {names}; physics by MuJoCo, camera by rays on the CPU (needs no GL)."
        if world.start_note:
            x, y, yaw = world.start
            self.announcement += f" It starts at [{x:.2f}, {y:.2f}, {yaw:.2f}], {world.start_note}."

    def _start_camera(self, seed: int) -> None:
        camera = self.robot.sensors.depth_camera
        self._camera: DepthCameraWorker | None = None
        if camera is not None:
            self._camera = DepthCameraWorker(DepthRenderer(camera, self.params.profile, seed))
        else:
            for port in (self.depth, self.camera_info, self.picture):
                port.withdraw()

    def stop(self) -> None:
        """End the camera's thread."""
        super().stop()
        if self._camera is not None:
            self._camera.close()

    # -- what the world is told

    def on_wheel_speeds(self, command: WheelSpeeds) -> None:
        """The board holds these until the next, or its watchdog."""
        self._board.command(command.left, command.right)

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Pressed: the board stops by itself. Released: it may drive again, after a new command."""
        if pressed.data:
            self._board.stop()
        elif self._pressed:
            self._board.clear()
        self._pressed = pressed.data

    def on_drop_box(self, at: PoseStamped) -> None:
        """Somebody puts a box down."""
        place = self._origin @ at.pose.se2
        self._try(lambda: self.simulation.drop_box(place.x, place.y, BOX))

    def on_kidnap(self, to: PoseStamped) -> None:
        """Somebody carries the robot away."""
        self._try(lambda: self.simulation.kidnap(self._origin @ to.pose.se2))

    def on_door(self, wish: String) -> None:
        """'open NAME' or 'close NAME'."""
        verb, _, name = wish.data.partition(" ")
        self._try(lambda: self.simulation.set_door(name, 1.0 if verb == "open" else 0.0))

    def on_sensor_fault(self, wish: String) -> None:
        """'FAULT scan' or 'FAULT depth', such as 'freeze scan'; the fault 'none' ends it. See sim.faults."""
        fault, _, sensor = wish.data.partition(" ")
        self._try(lambda: self._break(fault, sensor))

    def _break(self, fault: str, sensor: str) -> None:
        lines: dict[str, FaultySensor[LaserScan] | FaultySensor[Image]]
        lines = {"scan": self._lidar_line, "depth": self._camera_line}
        if sensor not in lines:
            raise UserError(f"There is no sensor {sensor!r} to break; it must be scan or depth")
        lines[sensor].fault = fault_named(fault)

    def _try(self, action: Callable[[], object]) -> None:
        """What cannot be done is told at the next tick; a device speaks in its own time only."""
        try:
            action()
        except UserError as error:
            self._remarks.append(str(error))

    # -- what the robot senses

    @every(hz=BOARD_HZ)
    def advance(self) -> None:
        """Physics up to now, what the board told, then all other sensors that are due."""
        for message in self._board.run_until(self.now_ns):
            self.publish_sensed(message)
        self._tick += 1
        sensors = self.robot.sensors
        if sensors.lidar is not None and self._due(sensors.lidar.rate):
            self._lidar_line.send(self._laser_scan(sensors.lidar), self.now_ns)
        if sensors.depth_camera is not None and self._due(sensors.depth_camera.rate):
            self._expose()
        if self._due(HEALTH_HZ):
            status = self._board.link.report("simulated", self.now_ns)
            self.diagnostics.publish(DiagnosticArray(self._header("base_link"), (status,)))
        if self._due(TRUTH_HZ):
            self._publish_truth()
        self._publish_collisions()

    def _due(self, rate: float) -> bool:
        return self._tick % max(1, round(BOARD_HZ / rate)) == 0

    def _header(self, frame: str) -> Header:
        return Header.of(self.now_ns, frame)

    def _laser_scan(self, lidar: Lidar) -> LaserScan:
        angles = lidar_angles(lidar)
        step = float(angles[1] - angles[0])
        limits = (lidar.range_min, lidar.range_max)
        ranges = self.simulation.lidar()
        period = 1.0 / lidar.rate
        return LaserScan(
            self._header("laser"), float(angles[0]), float(angles[-1]), step, 0.0, period, *limits, ranges
        )

    def _publish_truth(self) -> None:
        truth = self.simulation.truth()
        pose = PoseWithCovariance(Pose.of(self._origin.between(truth.pose)))
        twist = TwistWithCovariance(Twist.of(truth.v, truth.w))
        self.ground_truth.publish(Odometry(self._header("map"), "base_link", pose, twist))

    def _publish_collisions(self) -> None:
        for sentence in self._remarks:
            self.remark.publish(String(sentence))
        self._remarks.clear()
        collisions = self.simulation.collisions()
        if collisions.episodes > self._collisions:
            self._collisions = collisions.episodes
            touched = ", ".join(self.simulation.touching) or collisions.names[-1]
            self.collision.publish(Collision(self._header("map"), touched, collisions.episodes))

    # -- camera

    def _expose(self) -> None:
        """The frame is made in the camera's thread while the loop goes on, and handed over at its time."""
        assert self._camera is not None
        wanted = self.params.picture_hz
        coloured = wanted > 0 and self._due(wanted)
        self._camera.start(self.simulation.capture(), self._frames, coloured)
        self._frames += 1
        header = self._header("camera_depth_optical_frame")
        self.at(self.now_ns + CAMERA_LATENCY_NS, lambda: self._deliver(header))

    def _camera_info(self, header: Header) -> CameraInfo:
        """The ideal pinhole that the robot's file describes."""
        camera = self.robot.sensors.depth_camera
        assert camera is not None
        f, cx, cy = camera.focal_length_px, (camera.width - 1) / 2.0, (camera.height - 1) / 2.0
        k = np.array([f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0])
        p = np.array([f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0])
        r = np.eye(3).reshape(9)
        return CameraInfo(header, camera.height, camera.width, d=np.zeros(5), k=k, r=r, p=p)

    def _deliver(self, header: Header) -> None:
        assert self._camera is not None
        frame = self._camera.result()
        self._camera_line.send(Image.of(header, "32FC1", frame.depth), self.now_ns)
        self.camera_info.publish(self._camera_info(header))
        if frame.colour is not None:
            self.picture.publish(Image.of(header, "rgb8", frame.colour))
