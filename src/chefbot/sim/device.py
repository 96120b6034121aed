"""The simulated robot as a device: it publishes the same messages as the real one."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta

from chefbot.buildings.people_spec import MAX_PEOPLE, PeopleSpec
from chefbot.design.export.urdf_frames import COLOR_OPTICAL_FRAME
from chefbot.devices.board_node import MotorBoardNode
from chefbot.errors import UserError, name_hint
from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.chefbot_msgs import Collision, WheelSpeeds
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
)
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import CameraInfo, Image, JointState, LaserScan
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.robot.sensors import LIDAR_DRIVERS
from chefbot.runtime.node import In, Out, every, topic
from chefbot.scan.camera import CameraModel
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.cameras.color_camera import SimulatedColorCamera
from chefbot.sim.cameras.depth_camera import DepthFrame, DepthRenderer
from chefbot.sim.cameras.picture_renderer import RenderWorker
from chefbot.sim.faults.events import SimulatorFault
from chefbot.sim.faults.schedule import parse_request
from chefbot.sim.faults.simulated_robot import SimulatedRobotFaults
from chefbot.sim.faults.topic_sensors import faulty_camera, faulty_lidar
from chefbot.sim.lidar_scans import SimulatedScans
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.load import UnknownParam, WorldName, load_any_world, shares_map_frame

BOARD_HZ = 50
"""Rate of data exchange with the board; camera and lidar rates are rounded to a divisor of it."""
TRUTH_HZ = 10
HEALTH_HZ = 1
CAMERA_LATENCY_NS = 50_001_000
"""Time from exposure to delivery. The odd microsecond gives a frame a delivery time of its own, so that a log
without images, in which the scan takes their place, has the same order."""
BOX = (0.4, 0.4, 0.5)
"""Side lengths of a dropped box, metres."""

FAULTS = {
    "perfect": "without imperfections",
    "real": "with the imperfections of a real robot",
    "assembled": "with the imperfections of an uncalibrated robot",
}
"""Profile to its description in the announcement."""


class SimulatorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the simulator: world, start pose, imperfections, people and faults."""

    world: WorldName = "room"
    start: Annotated[
        str,
        Meta(
            description="start pose '[x, y, yaw]' in the world frame, m and rad; empty: the world's or a clear one"
        ),
    ] = ""
    unknown: UnknownParam = "auto"
    map: Annotated[
        str | None,
        Meta(
            description="map used by localization; empty: the world's own; none: its origin is the robot's start pose"
        ),
    ] = None
    map_frame: Annotated[
        Literal["auto", "world"],
        Meta(
            description="frame `map` of the ground truth: the world's; auto: a mapper's, or that of the world's map"
        ),
    ] = "auto"
    profile: Annotated[
        Literal["perfect", "real", "assembled"],
        Meta(
            description="imperfections of the robot: none, those of a calibrated one, or those of an uncalibrated one"
        ),
    ] = "real"
    people: Annotated[
        Annotated[int, Meta(ge=-1, le=MAX_PEOPLE)] | PeopleSpec,
        Meta(description="number of people, or who they are; -1: as in the world file"),
    ] = -1
    events: Annotated[
        tuple[SimulatorFault, ...],
        Meta(description="faults of sensors, wheels, battery, board and clocks, see docs/faults.md"),
    ] = ()
    odometry_error: Annotated[
        float,
        Meta(
            ge=0,
            le=10,
            description="factor on the errors of wheels, floor and gyro that the profile draws; 0: none",
        ),
    ] = 1.0
    lidar: Annotated[
        Literal["sweep", "snapshot"],
        Meta(
            description="sweep: it turns while the robot moves, as real ones; snapshot: all beams at one time"
        ),
    ] = "sweep"
    lidar_bytes: Annotated[
        str,
        Meta(
            description="model of an emulated lidar whose bytes are decoded by its driver; empty: scans directly"
        ),
    ] = ""
    picture_hz: Annotated[
        float,
        Meta(ge=0, le=10, description="rate of the depth camera's colour images for display, Hz; 0: none"),
    ] = 2.0


class SimulatorDevice(MotorBoardNode):
    """Device node that runs physics, motor board and sensors.

    `ground_truth` and `ground_truth/people` are for scoring and for display in the web UI; no node uses them.
    Wheels, IMU, ultrasonic ranger and battery are connected to the motor board: their data pass as bytes through
    its firmware and the driver's half of the serial link, at the firmware's rates. The frame `map` of the ground
    truth begins where the robot starts, as that of a mapper does; if the world is made of the very map that
    localization uses, it is the frame of that map.
    """

    live_params = ("picture_hz",)
    params: SimulatorParams
    drop_box: In[PoseStamped] = topic("simulation/drop_box")
    door: In[String] = topic("simulation/door")
    people_request: In[String] = topic("simulation/people")
    kidnap: In[PoseStamped] = topic("simulation/kidnap")
    fault: In[String] = topic("simulation/fault")
    scan: Out[LaserScan]
    depth: Out[Image] = topic("camera/depth/image_raw")
    camera_info: Out[CameraInfo] = topic("camera/depth/camera_info")
    picture: Out[Image] = topic("camera/color/image_raw")
    picture_info: Out[CameraInfo] = topic("camera/color/camera_info")
    ground_truth: Out[Odometry]
    people_truth: Out[PoseArray] = topic("ground_truth/people")
    collision: Out[Collision]
    notice: Out[String] = topic("simulation/notice")
    doors: Out[JointState] = topic("simulation/doors", latched=True)
    """Opening of each door, 0 closed .. 1 open, as the position of a joint."""

    def start(self) -> None:
        """Build the world and start the physics at the present time."""
        world = load_any_world(self.params.world, self.robot, self.params.start, self.params.unknown)
        people = None if self.params.people == -1 else self.params.people
        seed = int(self.context.rng().integers(2**31))
        self.simulation = Simulation(
            self.robot,
            world,
            self.params.profile,
            seed,
            people=people,
            odometry_error=self.params.odometry_error,
        )
        self._board = SimulatedBoard(self.robot, self.simulation, self.now_ns)
        self._origin = IDENTITY if self._map_frame_is_world() else self.simulation.truth().pose
        self._estop_pressed = False
        self._tick = 0
        self._frames = 0
        self._collisions = 0
        self._pending_notices: list[str] = []
        self._door_openings: dict[str, float] = {}
        rng = self.context.rng().spawn(1)[0]
        self._lidar_output = faulty_lidar(self.scan.publish, rng)
        self._camera_output = faulty_camera(self.depth.publish, rng)
        outputs = (self._lidar_output, self._camera_output)
        self._faults = SimulatedRobotFaults(
            self.params.events, self.simulation, self._board, *outputs, self._pending_notices.append
        )
        self._faults.schedule.advance(self.now_ns)
        self._start_camera(seed)
        self._start_lidar()
        if self.robot.sensors.lidar is None:
            self.scan.unadvertise()
        if not world.doors:
            self.doors.unadvertise()
        if not self.simulation.people:
            self.people_truth.unadvertise()
        description = f"robot {self.robot.name} in world {world.name}, {FAULTS[self.params.profile]}"
        self.announcement = (
            f"Simulated {description}; physics by MuJoCo, camera by rays on the CPU (needs no GL)."
        )
        if world.start_note:
            x, y, yaw = world.start
            self.announcement += f" It starts at [{x:.2f}, {y:.2f}, {yaw:.2f}], {world.start_note}."

    def _map_frame_is_world(self) -> bool:
        used = self.params.map
        return self.params.map_frame == "world" or (
            used is not None and shares_map_frame(self.params.world, used)
        )

    def _start_camera(self, seed: int) -> None:
        camera, color_camera = self.robot.sensors.depth_camera, self.robot.sensors.color_camera
        self._camera: RenderWorker[DepthFrame] | None = None
        self._color_camera: SimulatedColorCamera | None = None
        unused: list[Out[Any]] = []
        if camera is not None:
            self._renderer = DepthRenderer(camera, self.params.profile, seed)
            self._camera = RenderWorker("depth_camera")
        else:
            unused += [self.depth, self.camera_info]
        if color_camera is not None:
            self._color_camera = SimulatedColorCamera(color_camera, self.simulation)
        else:
            unused += [self.picture_info] if camera is not None else [self.picture, self.picture_info]
        for port in unused:
            port.unadvertise()

    def _start_lidar(self) -> None:
        lidar = self.robot.sensors.lidar
        self._scans: SimulatedScans | None = None
        if lidar is not None:
            mode = self.params.lidar_bytes or self.params.lidar
            if self.params.lidar_bytes not in ("", *LIDAR_DRIVERS):
                hint = name_hint(mode, LIDAR_DRIVERS)
                raise UserError(f"lidar_bytes: there is no driver {mode!r} for a lidar{hint}")
            self._scans = SimulatedScans(self.simulation, mode, self.now_ns, BOARD_HZ)
        elif self.params.lidar_bytes:
            raise UserError(f"robot {self.robot.name} has no lidar: lidar_bytes needs one")

    def stop(self) -> None:
        """Stop the device and the camera's thread."""
        super().stop()
        for camera in (self._camera, self._color_camera):
            if camera is not None:
                camera.close()

    # -- commands to the world

    def on_wheel_speeds(self, command: WheelSpeeds) -> None:
        """Send the wheel speeds to the board, which holds them until the next command or its watchdog."""
        self._board.command(command.left, command.right)

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Stop the board when pressed; when released, let it drive again after a new command."""
        if pressed.data:
            self._board.stop()
        elif self._estop_pressed:
            self._board.clear()
        self._estop_pressed = pressed.data

    def on_drop_box(self, pose: PoseStamped) -> None:
        """Drop a box at the requested pose."""
        world_pose = self._origin @ pose.pose.se2
        self._attempt(lambda: self.simulation.drop_box(world_pose.x, world_pose.y, BOX))

    def on_kidnap(self, pose: PoseStamped) -> None:
        """Move the robot to the requested pose (kidnapped robot)."""
        self._attempt(lambda: self.simulation.kidnap(self._origin @ pose.pose.se2))

    def on_door(self, request: String) -> None:
        """Open or close a door: 'open NAME' or 'close NAME'."""
        verb, _, name = request.data.partition(" ")
        self._attempt(lambda: self.simulation.set_door(name, 1.0 if verb == "open" else 0.0))

    def on_people_request(self, request: String) -> None:
        """Let people stand in a door or in the robot's way: 'meet DOOR NUMBER', 'block', and 'leave' to end it."""
        self._attempt(lambda: self.simulation.movers.request(request.data))

    def on_fault(self, request: String) -> None:
        """Begin a fault of sim.faults now: 'FAULT TARGET KEY=VALUE', e.g. 'freeze lidar'; 'none lidar' ends it."""
        self._attempt(lambda: self._request_fault(request.data))

    def _request_fault(self, text: str) -> None:
        requested = parse_request(text, self.now_ns)
        if isinstance(requested, str):
            self._faults.schedule.end_all(requested)
        elif isinstance(requested, SimulatorFault):
            self._faults.schedule.begin(requested)

    def _attempt(self, action: Callable[[], object]) -> None:
        """Run an action and keep its error for the next tick: a device publishes only at its own times."""
        try:
            action()
        except UserError as error:
            self._pending_notices.append(str(error))

    # -- sensors

    @every(hz=BOARD_HZ)
    def advance(self) -> None:
        """Run physics and board up to the present time, then publish all other sensors that are due."""
        for message in self._board.run_until(self.now_ns):
            self.publish_sensor_message(message)
        self.publish_connection(self._board.link.is_open)
        self.publish_fault(self._board.link.fault)
        self._faults.schedule.advance(self.now_ns)
        self._tick += 1
        sensors = self.robot.sensors
        if self._scans is not None:
            for scan in self._scans.advance(self.now_ns):
                self._send_scan(scan)
        if sensors.depth_camera is not None and self._due(sensors.depth_camera.rate):
            self._start_frame()
        if sensors.color_camera is not None and self._due(sensors.color_camera.rate):
            self._start_picture()
        if self._due(HEALTH_HZ):
            status = self._board.link.report("simulated", self.now_ns + self._board.clock_jump_ns)
            self.diagnostics.publish(DiagnosticArray(self._header("base_link"), (status,)))
        if self._due(TRUTH_HZ):
            self._publish_truth()
            self._publish_doors()
        self._publish_collisions()

    def _due(self, rate: float) -> bool:
        return self._tick % max(1, round(BOARD_HZ / rate)) == 0

    def _header(self, frame: str, clock_jump_ns: int = 0) -> Header:
        return Header.of(max(0, self.now_ns + clock_jump_ns), frame)

    def _send_scan(self, scan: LaserScan) -> None:
        """Publish a scan, with the error of the clock that stamps it."""
        stamp_ns = max(0, scan.header.stamp.ns + self._lidar_output.clock_jump_ns)
        self._lidar_output.send(
            msgspec.structs.replace(scan, header=Header.of(stamp_ns, "laser")), self.now_ns
        )

    def _publish_truth(self) -> None:
        truth = self.simulation.truth()
        pose = PoseWithCovariance(Pose.of(self._origin.between(truth.pose)))
        twist = TwistWithCovariance(Twist.of(truth.v, truth.w))
        header = self._header("map")
        self.ground_truth.publish(Odometry(header, "base_link", pose, twist))
        people = tuple(Pose.of(self._origin.between(person)) for person in self.simulation.people)
        if people:
            self.people_truth.publish(PoseArray(header, people))

    def _publish_doors(self) -> None:
        """Publish the doors' openings when they have changed."""
        openings = self.simulation.doors()
        if openings != self._door_openings:
            self._door_openings = openings
            position = np.array(list(openings.values()))
            self.doors.publish(JointState(self._header("map"), tuple(openings), position))

    def _publish_collisions(self) -> None:
        for notice in self._pending_notices:
            self.notice.publish(String(notice))
        self._pending_notices.clear()
        collisions = self.simulation.collisions()
        if collisions.episodes > self._collisions:
            self._collisions = collisions.episodes
            names = ", ".join(self.simulation.touching) or collisions.names[-1]
            self.collision.publish(Collision(self._header("map"), names, collisions.episodes))

    # -- camera

    def _start_frame(self) -> None:
        """Start rendering a frame in the camera's thread and schedule its delivery."""
        assert self._camera is not None
        picture_rate = self.params.picture_hz
        with_colour = picture_rate > 0 and self._due(picture_rate) and self._color_camera is None
        self._camera.start(
            partial(self._renderer.frame, self.simulation.capture(), self._frames, with_colour)
        )
        self._frames += 1
        header = self._header("camera_depth_optical_frame", self._camera_output.clock_jump_ns)
        self.schedule_at(self.now_ns + CAMERA_LATENCY_NS, lambda: self._publish_frame(header))

    def _publish_frame(self, header: Header) -> None:
        assert self._camera is not None and self.robot.sensors.depth_camera is not None
        frame = self._camera.result()
        self._camera_output.send(Image.of(header, "32FC1", frame.depth), self.now_ns)
        self.camera_info.publish(CameraModel.of(self.robot.sensors.depth_camera).camera_info(header))
        if frame.colour is not None:
            self.picture.publish(Image.of(header, "rgb8", frame.colour))

    def _start_picture(self) -> None:
        """Start rendering the colour camera's picture in its thread and schedule its delivery."""
        assert self._color_camera is not None
        self._color_camera.start()
        header = self._header(COLOR_OPTICAL_FRAME)
        self.schedule_at(self.now_ns + CAMERA_LATENCY_NS, lambda: self._publish_picture(header))

    def _publish_picture(self, header: Header) -> None:
        assert self._color_camera is not None
        self.picture_info.publish(self._color_camera.camera_info(header))
        self.picture.publish(Image.of(header, "rgb8", self._color_camera.result()))
