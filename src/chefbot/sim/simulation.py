"""The robot in its world: motors in, sensors out, one physics step at a time."""

from __future__ import annotations

import hashlib
import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.random import Generator, SeedSequence, default_rng
from numpy.typing import NDArray

from chefbot.design.export.mjcf import PHYSICS_STEP
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.robot.geometry.layout import ground_clearance, overall_height
from chefbot.robot.spec import Robot
from chefbot.sim.battery import Battery
from chefbot.sim.contacts import Collisions, ContactWatch
from chefbot.sim.motors import Motors, switch
from chefbot.sim.rays import (
    ULTRASONIC_NOISE,
    RayCaster,
    cone_rays,
    lidar_rays,
    mount_rotation,
    turned,
    within,
)
from chefbot.sim.realism import Profile, draw_as_built, draw_grip, draw_gyro_scale
from chefbot.sim.world.doors import MovingDoor
from chefbot.sim.world.furniture import PERSON_RADIUS, person_shapes
from chefbot.sim.world.people import Disc, disc, place_people
from chefbot.sim.world.shapes import Shape, ShapeArrays, box, clearance, joined, shape_arrays
from chefbot.sim.world.world import World
from chefbot.sim.world.world_mjcf import Mover, world_mjcf

STEP_NS = round(PHYSICS_STEP * 1e9)
MOVERS_EVERY = 8
"""Physics steps between two steps of people and doors (25 Hz)."""
MAX_DROPPED = 1000


class Truth(NamedTuple):
    """Where base_link really is, and how fast it moves: metres per second forward, rad/s to the left."""

    pose: SE2
    v: float
    w: float


class Capture(NamedTuple):
    """What a camera needs for a frame: its optical frame in the world and the solids round it at one instant.

    position: (3,) metres. rotation: (3, 3) from the optical frame (z forward, x right, y down) to the world.
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    shapes: ShapeArrays


OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""From the optical frame to the camera's body frame (REP-103)."""


class Simulation:
    """A robot in a world. The same arguments and calls give the same states, bit for bit.

    robot: as drawn; with every profile but `perfect` the simulated one differs, by `seed`.
    start: pose of base_link, `world.start` when None. people: how many walk, `world.people` when None.
    Raises UserError when the robot would stand in something.
    """

    def __init__(
        self,
        robot: Robot,
        world: World,
        profile: Profile = "perfect",
        seed: int = 0,
        start: SE2 | None = None,
        people: int | None = None,
    ) -> None:
        self.robot, self.world, self.profile, self.seed = robot, world, profile, seed
        built, grip, imu, lidar, sonar, walkers = (default_rng(s) for s in SeedSequence(seed).spawn(6))
        self.as_built = draw_as_built(profile, built)
        self._grip = draw_grip(profile, grip)
        self._noise = {"imu": imu, "lidar": lidar, "ultrasonic": sonar}
        self.battery = Battery(robot)
        self._motors = Motors.of(robot)
        self._duty, self._drivers = (0.0, 0.0), True
        self._steps = 0
        self._doors = {door.name: MovingDoor(door) for door in world.doors}
        self._dropped: list[Shape] = []
        place = world.start if start is None else start
        self._check_free(place, "the robot's start")
        count = world.people if people is None else people
        self._walkers = place_people(world.routes, count, self._disc(place), walkers.spawn(count))
        self._looks = [person_shapes(i) for i in range(count)]
        self._contacts = ContactWatch()
        self._prepare_sensors(imu)
        self._compile(place)
        self._inertia_before: NDArray[np.float64] = self._data.sensordata.copy()

    @property
    def time_ns(self) -> int:
        """Simulated time since the start."""
        return self._steps * STEP_NS

    def set_duty(self, left: float, right: float) -> None:
        """Share of the battery's voltage on each motor until the next call, -1..1; beyond is cut off."""
        if not (math.isfinite(left) and math.isfinite(right)):
            raise ValueError(f"duty must be finite, not {left}, {right}")
        self._duty = (min(max(left, -1.0), 1.0), min(max(right, -1.0), 1.0))

    def set_drivers(self, on: bool) -> None:
        """Motor drivers: off, the wheels turn freely whatever the duty; on, a duty of 0 brakes."""
        self._drivers = on
        switch(self._model, on)

    def step(self) -> None:
        """One physics step of 5 ms."""
        if self._steps % MOVERS_EVERY == 0:
            self._move_others()
            self._change_floor()
        data, drive = self._data, self.battery.drive
        data.ctrl[0], data.ctrl[1] = self._duty[0] * drive, self._duty[1] * drive
        self._inertia_before = data.sensordata.copy()
        mujoco.mj_step(self._model, data)
        self._steps += 1
        left, right = data.actuator_force.tolist()
        self.battery.drain(self._duty, self._motors.currents((left, right)), PHYSICS_STEP)
        self._contacts.update(data.contact.geom, self.time_ns)

    def wheel_ticks(self) -> tuple[int, int]:
        """Encoder counts (left, right) since the start: whole ticks, growing forward."""
        per_radian = self.robot.motor.ticks_per_turn / (2.0 * math.pi)
        left, right = self._data.qpos[7:9].tolist()
        built = self.as_built
        return (
            math.floor(left * per_radian * built.left_encoder),
            math.floor(right * per_radian * built.right_encoder),
        )

    def imu(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Angular velocity (3,) rad/s and specific force (3,) m/s^2 in imu_link; at rest z reads +9.8.

        The mean of the last two physics steps: a low-pass of 44 Hz, which the MPU-6050 sets to 42.
        """
        reading: NDArray[np.float64] = 0.5 * (self._inertia_before + self._data.sensordata)
        if self.profile != "perfect":
            imu, rng = self.robot.sensors.imu, self._noise["imu"]
            reading[:3] *= self.gyro_scale
            reading[:3] += self.gyro_offset + imu.gyro_noise * rng.standard_normal(3)
            reading[3:] += imu.accelerometer_noise * rng.standard_normal(3)
        return reading[:3], reading[3:]

    def lidar(self) -> NDArray[np.float32]:
        """(beams,) metres at `rays.lidar_angles`, all taken now; inf sees nothing, -inf is too close."""
        lidar = self.robot.sensors.lidar
        if lidar is None or self._lidar is None:
            raise UserError(f"robot {self.robot.name} has no lidar")
        ranges = self._lidar.cast(self._model, self._data, *self._attitude())
        ranges = np.minimum(ranges, self._lidar.own_body)
        if self.profile != "perfect":
            ranges = ranges + lidar.noise * self._noise["lidar"].standard_normal(lidar.beams)
        return within(ranges, lidar.range_min, lidar.range_max)

    def echo(self) -> float:
        """Metres to the nearest thing that throws sound back to the ultrasonic ranger; inf for none."""
        if self._ultrasonic is None:
            raise UserError(f"robot {self.robot.name} has no ultrasonic ranger")
        nearest = float(self._ultrasonic.echoes(self._model, self._data, *self._attitude()).min())
        if self.profile != "perfect":
            nearest += ULTRASONIC_NOISE * float(self._noise["ultrasonic"].standard_normal())
        return nearest

    def ultrasonic(self) -> float:
        """`echo` as the ranger tells it: inf beyond its reach, -inf too close."""
        nearest, ranger = np.array([self.echo()]), self.robot.sensors.ultrasonic
        assert ranger is not None
        return float(within(nearest, ranger.range_min, ranger.range_max)[0])

    def capture(self) -> Capture:
        """The depth camera's view now; render it with DepthCamera or hand it to a DepthCameraWorker."""
        camera = self.robot.sensors.depth_camera
        if camera is None:
            raise UserError(f"robot {self.robot.name} has no depth camera")
        position, rotation = self._attitude()
        mount = turned(camera.mount, self.as_built.camera_yaw)
        at = position + rotation @ np.array([mount.x, mount.y, mount.z])
        moving = shape_arrays(self._moving_shapes())
        return Capture(at, rotation @ mount_rotation(mount) @ OPTICAL, joined(self._static, moving))

    def truth(self) -> Truth:
        """The robot's real pose and speed."""
        x, y, _, qw, qx, qy, qz = self._data.qpos[:7].tolist()
        yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        vx, vy = self._data.qvel[:2].tolist()
        return Truth(SE2(x, y, yaw), vx * math.cos(yaw) + vy * math.sin(yaw), float(self._data.qvel[5]))

    def collisions(self) -> Collisions:
        """Episodes of contact since the start, and what was touched."""
        return self._contacts.collisions

    @property
    def touching(self) -> tuple[str, ...]:
        """What the robot touches now."""
        return self._contacts.touching

    @property
    def tilt(self) -> float:
        """Angle in radians between the robot's axis and the vertical."""
        _, qx, qy, _ = self._data.qpos[3:7].tolist()
        return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (qx * qx + qy * qy))))

    @property
    def warnings(self) -> int:
        """How often MuJoCo complained about the numbers; anything but 0 is a fault of the model."""
        return int(self._data.warning.number.sum())

    @property
    def people(self) -> list[SE2]:
        """Where people stand and which way they face."""
        return [walker.pose for walker in self._walkers]

    def state_hash(self) -> str:
        """SHA-256 of everything that moves; equal for equal arguments and calls."""
        digest = hashlib.sha256(self._state().tobytes())
        digest.update(repr((self._steps, self.battery.charge, self.people)).encode())
        return digest.hexdigest()

    def drop_box(self, x: float, y: float, size: tuple[float, float, float]) -> str:
        """Put a box (sides in metres) on the floor and return its name; UserError where the robot stands."""
        if len(self._dropped) >= MAX_DROPPED:
            raise UserError(f"{MAX_DROPPED} boxes have been dropped; that is enough")
        if not all(0.0 < side <= 10.0 for side in size) or not max(abs(x), abs(y)) < 1000.0:
            raise UserError(f"a box of {size} m at ({x}, {y}): sides are from 0 to 10 m, places within 1 km")
        name = f"dropped_{len(self._dropped) + 1}"
        item = box(name, SE2(x, y, 0.0), 0.0, size, (196, 150, 90))
        pose = self.truth().pose
        for px, py, radius in [self._disc(pose), *(disc(w) for w in self._walkers)]:
            if clearance([item], px, py, 0.0, math.inf) < radius:
                raise UserError(f"the box at ({x:.2f}, {y:.2f}) would fall on the robot or on a person")
        self._dropped.append(item)
        state = self._state()
        self._compile(pose)
        mujoco.mj_setState(self._model, self._data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_forward(self._model, self._data)
        return name

    def kidnap(self, pose: SE2) -> None:
        """Lift the robot and set it down elsewhere, at rest; wheels do not turn. UserError if not free."""
        self._check_free(pose, "the place to set the robot down")
        for i, walker in enumerate(self._walkers):
            if pose.distance(walker.pose) < self.robot.footprint_radius + PERSON_RADIUS:
                raise UserError(
                    f"person_{i} stands where the robot is to be set down; wait or choose another place"
                )
        self._data.qpos[:7] = [pose.x, pose.y, 0.0, math.cos(pose.yaw / 2), 0.0, 0.0, math.sin(pose.yaw / 2)]
        self._data.qvel[:] = 0.0
        mujoco.mj_forward(self._model, self._data)

    def set_door(self, name: str, open_fraction: float) -> None:
        """Let a door move to 0 (closed) .. 1 (open); it takes two seconds and stops before the robot."""
        if not 0.0 <= open_fraction <= 1.0:
            raise UserError(f"a door opens between 0 and 1, not {open_fraction}")
        self._doors[self.world.door(name).name].target = open_fraction

    def door(self, name: str) -> float:
        """How far a door is open now, 0..1."""
        return self._doors[self.world.door(name).name].open

    def _prepare_sensors(self, rng: Generator) -> None:
        sensors = self.robot.sensors
        self._lidar: RayCaster | None
        self._ultrasonic: RayCaster | None
        self.gyro_offset = sensors.imu.gyro_bias * rng.standard_normal(3)
        self.gyro_scale = draw_gyro_scale(self.as_built, rng)
        lidar, ranger = sensors.lidar, sensors.ultrasonic
        self._lidar = self._ultrasonic = None
        if lidar is not None:
            mount = turned(lidar.mount, self.as_built.lidar_yaw)
            self._lidar = RayCaster(mount, lidar_rays(lidar, mount), lidar.range_max + 1.0)
        if ranger is not None:
            self._ultrasonic = RayCaster(ranger.mount, cone_rays(ranger), ranger.range_max + 1.0)

    def _compile(self, start: SE2) -> None:
        solids = (*self.world.static, *self._dropped)
        self._static = shape_arrays(solids)
        xml = world_mjcf(self.robot, solids, self._movers(), self.as_built, start)
        self._model: Any = mujoco.MjModel.from_xml_string(xml)
        self._data: Any = mujoco.MjData(self._model)
        self._motors.install(self._model)
        switch(self._model, self._drivers)
        self._wheels = [self._model.geom(f"wheel_{side}").id for side in ("left", "right")]
        self._contacts.watch(self._model)
        self._place_movers()
        mujoco.mj_forward(self._model, self._data)
        if self._lidar is not None:
            self._lidar.look_at_own_body(self._model, self._data, *self._attitude())

    def _movers(self) -> list[Mover]:
        doors = [Mover(name, (door.leaf,), door.pose) for name, door in self._doors.items()]
        people = [
            Mover(f"person_{i}", look, walker.pose)
            for i, (look, walker) in enumerate(zip(self._looks, self._walkers, strict=True))
        ]
        return doors + people

    def _moving_shapes(self) -> list[Shape]:
        return [shape.moved(mover.pose) for mover in self._movers() for shape in mover.shapes]

    def _move_others(self) -> None:
        """People and doors move on, each seeing where the others are."""
        if not self._walkers and not any(door.moving for door in self._doors.values()):
            return
        duration = MOVERS_EVERY * PHYSICS_STEP
        robot = self._disc(self.truth().pose)
        crowd = [robot, *(disc(walker) for walker in self._walkers)]
        moved = [door.advance(duration, crowd) for door in self._doors.values()]
        things = [*(door.shape for door in self._doors.values()), *self._dropped] if self._walkers else []
        for walker in self._walkers:
            others = [robot, *(disc(other) for other in self._walkers if other is not walker)]
            walker.advance(duration, others, things)
        if self._walkers or any(moved):
            self._place_movers()

    def _place_movers(self) -> None:
        for i, mover in enumerate(self._movers()):
            x, y, yaw = mover.pose
            self._data.mocap_pos[i] = (x, y, 0.0)
            self._data.mocap_quat[i] = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))

    def _change_floor(self) -> None:
        if len(self._grip.waves) == 0:
            return
        x, y = self._data.qpos[:2].tolist()
        friction = self.robot.wheels.friction * self.as_built.friction * self._grip.factor(x, y)
        self._model.geom_friction[self._wheels, 0] = friction

    def _attitude(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """base_link in the world: position (3,) and rotation (3, 3)."""
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._data.qpos[3:7])
        return self._data.qpos[:3].copy(), rotation.reshape(3, 3)

    def _disc(self, pose: SE2) -> Disc:
        return pose.x, pose.y, self.robot.footprint_radius

    def _check_free(self, pose: SE2, what: str) -> None:
        if not all(math.isfinite(value) for value in pose):
            raise UserError(f"{what} {tuple(pose)} is not made of finite numbers")
        solids = [*self.world.static, *self._dropped, *(door.shape for door in self._doors.values())]
        space = (ground_clearance(self.robot), overall_height(self.robot))
        if clearance(solids, pose.x, pose.y, *space) < self.robot.footprint_radius:
            near = min(solids, key=lambda s: clearance([s], pose.x, pose.y, *space)).name.split("/")[0]
            raise UserError(
                f"{what} ({pose.x:.2f}, {pose.y:.2f}) in world {self.world.name} overlaps {near}; "
                "choose another"
            )

    def _state(self) -> NDArray[np.float64]:
        size = mujoco.mj_stateSize(self._model, mujoco.mjtState.mjSTATE_INTEGRATION)
        state = np.empty(size)
        mujoco.mj_getState(self._model, self._data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        return state
