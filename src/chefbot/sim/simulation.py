"""Simulation of the robot in its world: motor duties in, sensor readings out, one physics step at a time."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.random import Generator, SeedSequence, default_rng
from numpy.typing import NDArray

from chefbot.buildings.people_spec import PeopleSpec, people_spec
from chefbot.design.export.mjcf import PHYSICS_STEP
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.robot.as_built import AsBuilt
from chefbot.robot.geometry.layout import ground_clearance, overall_height
from chefbot.robot.section import Mount
from chefbot.robot.spec import Robot
from chefbot.sim.battery import SimulatedBattery
from chefbot.sim.cameras.capture import Capture, optical_frame
from chefbot.sim.cameras.depth_holes import hole_array
from chefbot.sim.cameras.tag_faces import tag_faces
from chefbot.sim.contacts import Collisions, ContactMonitor
from chefbot.sim.faults.wheels import WheelFaults
from chefbot.sim.ground_truth import GroundTruth, ground_truth
from chefbot.sim.motors import Motors, enable_drivers
from chefbot.sim.movers import Movers
from chefbot.sim.nearby_solids import NearbySolids
from chefbot.sim.people.people import RobotCircle
from chefbot.sim.rays import (
    ULTRASONIC_NOISE,
    BasePose,
    RayCaster,
    RayScene,
    cone_rays,
    lidar_rays_of,
    rotate_mount,
    to_rep117,
)
from chefbot.sim.realism import ImuErrors, RealismProfile, draw_as_built, draw_floor_friction, draw_gyro_scale
from chefbot.sim.world.floor import carpet_at, floor_slabs
from chefbot.sim.world.shapes import (
    SimulatedShape,
    box,
    clearance,
    concatenate,
    shape_arrays,
)
from chefbot.sim.world.world import World, nearest_name
from chefbot.sim.world.world_mjcf import world_mjcf

STEP_NS = round(PHYSICS_STEP * 1e9)
STEPS_PER_MOVER_UPDATE = 8
"""Physics steps between two updates of people and doors (25 Hz)."""
MAX_DROPPED_BOXES = 1000


class Simulation:
    """A robot in a world, simulated with MuJoCo. Equal arguments and calls give bit-identical states.

    robot: the robot as drawn; with every profile but `perfect` the simulated one deviates, drawn by `seed`.
    start: pose of base_link, `world.start` when None. people: who walks about, or just how many; `world.people`
    when None. odometry_error: factor on the odometry's errors that the profile draws.
    Raises UserError when the robot would overlap an obstacle.
    """

    def __init__(
        self,
        robot: Robot,
        world: World,
        profile: RealismProfile = "perfect",
        seed: int = 0,
        start: SE2 | None = None,
        people: int | PeopleSpec | None = None,
        odometry_error: float = 1.0,
    ) -> None:
        self.robot, self.world, self.profile, self.seed = robot, world, profile, seed
        build_rng, grip_rng, imu_rng, lidar_rng, sonar_rng, people_rng = (
            default_rng(s) for s in SeedSequence(seed).spawn(6)
        )
        self.as_built = draw_as_built(profile, build_rng, odometry_error)
        self._odometry_error = odometry_error
        self._grip = draw_floor_friction(profile, grip_rng, odometry_error)
        self.noise = {"imu": imu_rng, "lidar": lidar_rng, "ultrasonic": sonar_rng}
        self.battery = SimulatedBattery(robot)
        self._motors = Motors.of(robot)
        self._duty, self._drivers_enabled = (0.0, 0.0), True
        self._steps = 0
        self._dropped: list[SimulatedShape] = []
        self._holes = hole_array(world.holes)
        start_pose = world.start if start is None else start
        self._check_free(start_pose, "the robot's start", world.shapes_at_rest())
        spec = people_spec(world.people if people is None else people)
        self.movers = Movers(world, spec, RobotCircle.of(start_pose, robot.circumscribed_radius), people_rng)
        self._contacts = ContactMonitor()
        self.wheel_faults = WheelFaults()
        self.lidar_caster: RayCaster | None
        self._prepare_sensors(imu_rng)
        self._nearby = NearbySolids(dataclasses.replace(world, static=self.movers.fixed), robot)
        self._nearby.follow(start_pose.x, start_pose.y)
        self._compile(start_pose)
        self._previous_imu: NDArray[np.float64] = self._data.sensordata.copy()

    @property
    def time_ns(self) -> int:
        """Simulated time since the start, ns."""
        return self._steps * STEP_NS

    def set_duty(self, left: float, right: float) -> None:
        """Set the duty cycle of each motor, -1..1 of the battery voltage, until the next call.

        Values beyond the limits are clipped; ValueError for values that are not finite.
        """
        if not (math.isfinite(left) and math.isfinite(right)):
            raise ValueError(f"duty must be finite, not {left}, {right}")
        self._duty = (min(max(left, -1.0), 1.0), min(max(right, -1.0), 1.0))

    def set_drivers(self, on: bool) -> None:
        """Switch the motor drivers: off, the wheels turn freely whatever the duty; on, a duty of 0 brakes."""
        if on != self._drivers_enabled:
            self._drivers_enabled = on
            enable_drivers(self._model, on)

    def step(self) -> None:
        """Advance the simulation by one physics step of 5 ms."""
        if self._steps % STEPS_PER_MOVER_UPDATE == 0:
            self._simulate_solids_around(*self._data.qpos[:2].tolist())
            self.advance_movers(STEPS_PER_MOVER_UPDATE * PHYSICS_STEP)
            self._update_floor_friction()
        data, voltage_ratio = self._data, self.battery.voltage_ratio
        # Motor input: duty times the battery voltage as a share of the rated voltage.
        data.ctrl[0], data.ctrl[1] = self._duty[0] * voltage_ratio, self._duty[1] * voltage_ratio
        self._previous_imu = data.sensordata.copy()
        if self.wheel_faults.shoving:
            self.wheel_faults.shove_once(data)
        mujoco.mj_step(self._model, data)
        self._steps += 1
        left_torque, right_torque = data.actuator_force.tolist()
        # Motor currents follow from the torques; the battery voltage sags with them.
        self.battery.drain(self._duty, self._motors.currents((left_torque, right_torque)), PHYSICS_STEP)
        self._contacts.update(data.contact.geom, data.qvel, self.time_ns)

    def advance_movers(self, duration: float) -> None:
        """Advance people and doors by `duration` s; `step` does so at its time."""
        self.movers.advance(duration, self._robot_circle(), self._data)

    def wheel_ticks(self) -> tuple[int, int]:
        """Return the encoder counts (left, right) since the start: whole ticks, increasing forward."""
        ticks_per_radian = self.robot.motor.ticks_per_radian
        # Joint angles of the wheels follow the free joint (7 values) in qpos.
        left, right = self._data.qpos[7:9].tolist()
        built = self.as_built
        return (
            math.floor(left * ticks_per_radian * built.left_encoder),
            math.floor(right * ticks_per_radian * built.right_encoder),
        )

    def imu(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angular velocity (3,) rad/s and specific force (3,) m/s^2 in imu_link; at rest z reads +9.8.

        Both are means of the last two physics steps: a low-pass of 44 Hz, near the 42 Hz set in the MPU-6050.
        """
        reading: NDArray[np.float64] = self._previous_imu + self._data.sensordata
        reading *= 0.5
        if self.profile != "perfect":
            self._imu_errors.apply(reading, self.noise["imu"])
        return reading[:3], reading[3:]

    def lidar(self) -> NDArray[np.float32]:
        """Return (beams,) ranges in metres at `rays.lidar_angles`, all taken now; by REP-117 (inf, -inf)."""
        lidar = self.robot.sensors.lidar
        if lidar is None or self.lidar_caster is None:
            raise UserError(f"robot {self.robot.name} has no lidar")
        ranges = self.lidar_caster.light(self.ray_scene(), self.base_pose())
        ranges = np.minimum(ranges, self.lidar_caster.own_body)
        if self.profile != "perfect":
            ranges = ranges + lidar.noise * self.noise["lidar"].standard_normal(lidar.beams)
        return to_rep117(ranges, lidar.range_min, lidar.range_max)

    def echo(self) -> float:
        """Return the distance to the nearest surface that reflects ultrasound, m; inf if there is none."""
        if self._ultrasonic is None:
            raise UserError(f"robot {self.robot.name} has no ultrasonic ranger")
        nearest = float(self._ultrasonic.echoes(self.ray_scene(), self.base_pose()).min())
        if self.profile != "perfect":
            nearest += ULTRASONIC_NOISE * float(self.noise["ultrasonic"].standard_normal())
        return nearest

    def ultrasonic(self) -> float:
        """Return `echo` as the ranger reports it: inf beyond maximum range, -inf below minimum range."""
        nearest, ranger = np.array([self.echo()]), self.robot.sensors.ultrasonic
        assert ranger is not None
        return float(to_rep117(nearest, ranger.range_min, ranger.range_max)[0])

    def capture(self) -> Capture:
        """Return the depth camera's current view; render it with a DepthRenderer."""
        camera, built = self.robot.sensors.depth_camera, self.as_built
        if camera is None:
            raise UserError(f"robot {self.robot.name} has no depth camera")
        return self._view(rotate_mount(camera.mount, built.camera_yaw), built.camera_upside_down)

    def color_capture(self) -> Capture:
        """Return the colour camera's current view; render it with a PictureRenderer."""
        camera = self.robot.sensors.color_camera
        if camera is None:
            raise UserError(f"robot {self.robot.name} has no colour camera")
        return self._view(camera.mount)

    def _view(self, mount: Mount, upside_down: bool = False) -> Capture:
        shapes = concatenate(self._static, self.movers.shapes())
        frame = optical_frame(self.base_pose(), mount, upside_down)
        return Capture(*frame, shapes, self._holes, tag_faces(self.world.tags))

    def truth(self) -> GroundTruth:
        """Return the robot's ground-truth pose and twist."""
        return ground_truth(self._data.qpos, self._data.qvel)

    def collisions(self) -> Collisions:
        """Return the number of contact episodes since the start and the objects touched."""
        return self._contacts.collisions

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the objects that the robot is touching."""
        return self._contacts.touching

    @property
    def tilt(self) -> float:
        """Angle between the robot's vertical axis and the world's vertical, rad."""
        _, qx, qy, _ = self._data.qpos[3:7].tolist()
        # cos(tilt) is the z component of the body's z axis.
        return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (qx * qx + qy * qy))))

    @property
    def warnings(self) -> int:
        """Number of numerical warnings from MuJoCo; anything but 0 indicates a faulty model."""
        return int(self._data.warning.number.sum())

    @property
    def people(self) -> list[SE2]:
        """Poses of the people, x forward."""
        return self.movers.people_poses()

    def solids(self) -> list[SimulatedShape]:
        """Return all solids where they are now, without the people."""
        return [*self.movers.fixed, *self._dropped, *self.movers.doors_and_chairs()]

    def drop_box(self, x: float, y: float, size: tuple[float, float, float], bottom: float = 0.0) -> str:
        """Put a box (side lengths in metres) on the floor, or hang it `bottom` metres above it; return its name.

        Raises UserError if it would be over or in the robot or a person.
        """
        if len(self._dropped) >= MAX_DROPPED_BOXES:
            raise UserError(f"{MAX_DROPPED_BOXES} boxes have been dropped, which is the maximum")
        near = abs(x) < 1000.0 and abs(y) < 1000.0 and 0.0 <= bottom <= 10.0
        if not (near and all(0.0 < side <= 10.0 for side in size)):
            raise UserError(f"a box of {size} m at ({x}, {y}): sides are from 0 to 10 m, places within 1 km")
        name = f"dropped_{len(self._dropped) + 1}"
        item = box(name, SE2(x, y, 0.0), bottom, size, (196, 150, 90))
        pose = self.truth().pose
        robot = pose.x, pose.y, self.robot.circumscribed_radius
        for px, py, radius in [robot, *self.movers.people_circles()]:
            if clearance([item], px, py, 0.0, math.inf) < radius:
                raise UserError(f"the box at ({x:.2f}, {y:.2f}) would fall on the robot or on a person")
        self._dropped.append(item)
        self.movers.add_solid(item)
        self._recompile()
        return name

    def kidnap(self, pose: SE2) -> None:
        """Lift the robot and set it down at another pose, at rest; the wheels do not turn.

        Raises UserError if the pose is not free.
        """
        self._check_free(pose, "the place to set the robot down", self.solids())
        for i, (x, y, radius) in enumerate(self.movers.people_circles()):
            if math.dist(pose[:2], (x, y)) < self.robot.circumscribed_radius + radius:
                raise UserError(
                    f"person_{i} stands where the robot is to be set down; wait or choose another place"
                )
        self._simulate_solids_around(pose.x, pose.y)
        # Free joint of base_link: position and quaternion (w, x, y, z) of a rotation about z.
        self._data.qpos[:7] = [pose.x, pose.y, 0.0, math.cos(pose.yaw / 2), 0.0, 0.0, math.sin(pose.yaw / 2)]
        self._data.qvel[:] = 0.0
        mujoco.mj_forward(self._model, self._data)

    def set_door(self, name: str, open_fraction: float) -> None:
        """Set a door's target, 0 (closed) .. 1 (open); it takes two seconds and stops for the robot."""
        if not 0.0 <= open_fraction <= 1.0:
            raise UserError(f"a door opens between 0 and 1, not {open_fraction}")
        self.movers.doors[self.world.door(name).name].target = open_fraction

    def doors(self) -> dict[str, float]:
        """Return the current opening of each door by name, 0..1."""
        return {name: door.open for name, door in self.movers.doors.items()}

    def remount(self, as_built: AsBuilt) -> None:
        """Turn the mounts of lidar and depth camera to those of `as_built`."""
        self.as_built, lidar = as_built, self.robot.sensors.lidar
        if lidar is not None:
            self.lidar_caster = lidar_rays_of(lidar, as_built)
            self._find_own_body()

    def _prepare_sensors(self, rng: Generator) -> None:
        sensors, error = self.robot.sensors, self._odometry_error
        self._ultrasonic: RayCaster | None = None
        self.gyro_offset = error * sensors.imu.gyro_bias * rng.standard_normal(3)
        self.gyro_scale = draw_gyro_scale(self.as_built, rng, error)
        self._imu_errors = ImuErrors.of(sensors.imu, self.gyro_scale, self.gyro_offset, error)
        lidar, ranger = sensors.lidar, sensors.ultrasonic
        self.lidar_caster = None if lidar is None else lidar_rays_of(lidar, self.as_built)
        if ranger is not None:
            self._ultrasonic = RayCaster(ranger.mount, cone_rays(ranger), ranger.range_max + 1.0)

    def _compile(self, start: SE2) -> None:
        solids = (*self._nearby.touchable, *self._dropped)
        dropped = shape_arrays(self._dropped)
        self._static = concatenate(self._nearby.visible, dropped)
        slabs = floor_slabs(self.world.bounds, self.world.holes) if self.world.holes else []
        self._reflecting = concatenate(concatenate(self._nearby.reflecting, dropped), shape_arrays(slabs))
        xml = world_mjcf(self.robot, solids, self.movers.mocap_bodies(), self.as_built, start, slabs)
        self._model: Any = mujoco.MjModel.from_xml_string(xml)
        # Static solids are not calculated in every step; the robot itself never sleeps.
        self._model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
        self._model.tree_sleep_policy[:] = mujoco.mjtSleepPolicy.mjSLEEP_NEVER
        self._data: Any = mujoco.MjData(self._model)
        # The MJCF has the linear motor model; friction and torque limits are set in the compiled model.
        self._motors.install(self._model)
        enable_drivers(self._model, self._drivers_enabled)
        self._wheels = [self._model.geom(f"wheel_{side}").id for side in ("left", "right")]
        self._contacts.watch(self._model)
        self.movers.write(self._data)
        self.wheel_faults.install(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._find_own_body()

    def _find_own_body(self) -> None:
        if self.lidar_caster is not None:
            self.lidar_caster.find_own_body(self._model, self._data, self.base_pose())

    def _recompile(self) -> None:
        """Compile the model with the solids of now, and restore the dynamic state."""
        state, friction = self._state(), self._model.geom_friction[self._wheels, 0].copy()
        self._compile(self.truth().pose)
        mujoco.mj_setState(self._model, self._data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        self._model.geom_friction[self._wheels, 0] = friction
        mujoco.mj_forward(self._model, self._data)

    def _simulate_solids_around(self, x: float, y: float) -> None:
        """Of a large map, simulate only the solids around a place."""
        if self._nearby.follow(x, y):
            self._recompile()

    def _update_floor_friction(self) -> None:
        if len(self._grip.waves) == 0 and not self.world.carpets and not self.wheel_faults.slipped:
            return
        x, y = self._data.qpos[:2].tolist()
        # Sliding friction of the wheel geoms follows the floor under the robot.
        carpet = carpet_at(self.world.carpets, x, y)
        tyre = self.robot.wheels.friction if carpet is None else carpet.friction
        friction = tyre * self.as_built.friction * self._grip.factor(x, y)
        self._model.geom_friction[self._wheels, 0] = friction * self.wheel_faults.friction

    def ray_scene(self) -> RayScene:
        """Return the solids that reflect light and sound, where they are now."""
        return RayScene(concatenate(self._reflecting, self.movers.shapes()), not self.world.holes)

    def base_pose(self) -> BasePose:
        """Return position (3,) m and rotation (3, 3) of base_link in the world."""
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._data.qpos[3:7])
        return self._data.qpos[:3].copy(), rotation.reshape(3, 3)

    def _robot_circle(self) -> RobotCircle:
        """Return the robot as people see it; its front without trigonometric functions."""
        x, y, _, qw, qx, qy, qz = self._data.qpos[:7].tolist()
        ux, uy = 1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qw * qz + qx * qy)
        length = math.sqrt(ux * ux + uy * uy)
        return RobotCircle(x, y, ux / length, uy / length, self.robot.circumscribed_radius)

    def _check_free(self, pose: SE2, what: str, solids: Sequence[SimulatedShape]) -> None:
        if not all(math.isfinite(value) for value in pose):
            raise UserError(f"{what} {tuple(pose)} is not made of finite numbers")
        height_range = (ground_clearance(self.robot), overall_height(self.robot))
        if clearance(solids, pose.x, pose.y, *height_range) < self.robot.circumscribed_radius:
            obstacle_name = nearest_name(solids, pose, height_range)
            raise UserError(
                f"{what} ({pose.x:.2f}, {pose.y:.2f}) in world {self.world.name} overlaps {obstacle_name}; "
                "choose another"
            )

    def _state(self) -> NDArray[np.float64]:
        size = mujoco.mj_stateSize(self._model, mujoco.mjtState.mjSTATE_INTEGRATION)
        state = np.empty(size)
        mujoco.mj_getState(self._model, self._data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        return state
