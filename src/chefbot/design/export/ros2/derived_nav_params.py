"""Figures of a robot that navigation parameters derive from, each with its formula and numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from chefbot.design.errors import DesignError
from chefbot.design.export.ros2.annotated_yaml import Explained, rounded, rounded_down, short
from chefbot.design.export.urdf_frames import DEPTH_FRAME
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.motion_limits import (
    max_acceleration,
    max_deceleration,
    max_speed,
    max_turn,
    max_turn_acceleration,
    max_turn_deceleration,
    max_wheel_speed,
    turn_rate_on_spot,
)
from chefbot.robot.plate_shape import RoundPlate
from chefbot.robot.sensors import FULL_TURN_TOLERANCE
from chefbot.robot.spec import Robot

CELLS = (0.05, 0.025, 0.02, 0.01)
"""Sides of a map's cell in use, m: the usual 5 cm, and finer for small robots."""
CELLS_PER_RADIUS = 3.0
"""Minimum resolution of a circular footprint, cells per radius."""
MIN_FREQUENCY, MAX_FREQUENCY = 10.0, 30.0
"""Hz: limits of the controller frequency; below, commands come close to the timeout of the base."""
EDGE = 2.0
"""Natural logarithm of the decay of costs at the inflation radius: 252 to 34, as in chefbot's costmap."""


class OdometryErrors(NamedTuple):
    """Standard deviations of the odometry's errors, as in the parameters of the odometry node."""

    slip: float
    """m after one metre of a wheel; it grows with the root of the distance."""
    diameter_error: float
    separation_error: float


class ScanSensor(NamedTuple):
    """The sensor that the scan is made from; metres, Hz, radians."""

    sensor: str
    topic: str
    frame: str
    rate: float
    range_min: float
    range_max: float
    """Maximum range whose noise is within a map cell."""
    far: float
    """Maximum range of the sensor."""
    noise: float
    """Standard deviation of a range at `range_max`."""
    angle: float
    """Field of view."""
    height: float

    @property
    def covers_rear(self) -> bool:
        """Whether the robot sees where it drives in reverse."""
        return self.angle >= 2.0 * math.pi - FULL_TURN_TOLERANCE


@dataclass(frozen=True)
class Figures:
    """The figures that several navigation parameters share."""

    robot: Robot
    odometry_errors: OdometryErrors

    @cached_property
    def scan_sensor(self) -> ScanSensor:
        """Return the sensor for mapping. DesignError if the robot has none."""
        lidar, camera = self.robot.sensors.lidar, self.robot.sensors.depth_camera
        if lidar is not None:
            return ScanSensor(
                "lidar", "/scan", "laser", lidar.rate, lidar.range_min, lidar.range_max, lidar.range_max,
                lidar.noise, lidar.field_of_view, lidar.mount.z,
            )  # fmt: skip
        if camera is None:
            raise DesignError(
                f"robot {self.robot.name} has neither sensors.lidar nor sensors.depth_camera: navigation needs one"
            )
        useful = camera.range_with_noise(self.resolution.number)
        return ScanSensor(
            "depth camera", "/scan", DEPTH_FRAME, camera.rate, camera.range_min, useful, camera.range_max,
            camera.noise * useful**2, camera.field_of_view, camera.mount.z,
        )  # fmt: skip

    @cached_property
    def range_min(self) -> Figure:
        """Return the minimum range of the scan, m."""
        return Figure(self.scan_sensor.range_min, f"the {self.scan_sensor.sensor}'s minimum range")

    @cached_property
    def range_max(self) -> Figure:
        """Return the maximum range of the scan whose noise is within a map cell, m."""
        sensor = self.scan_sensor
        return Figure(
            sensor.range_max,
            f"range of the {sensor.sensor}, {short(sensor.far)} m, up to a noise of a cell:"
            f" {short(sensor.noise)} m of {short(self.resolution.number)} m",
        )

    @cached_property
    def radius(self) -> Figure:
        """Return the circumscribed radius of the footprint, m."""
        robot, plate = self.robot, self.robot.body.plate
        shape = (
            f"the larger of body.radius {short(plate.radius)} and the wheels' corners,"
            f" {short(robot.wheel_corner_radius)}"
            if isinstance(plate, RoundPlate)
            else "distance of the farthest corner of the footprint from the middle of the axle"
        )
        return Figure(math.ceil(robot.circumscribed_radius * 1e4) / 1e4, shape)

    @cached_property
    def polygon(self) -> str:
        """Return the corners of a polygonal footprint, m, in the notation of Nav2; empty for a disc."""
        corners = ", ".join(f"[{x:.4f}, {y:.4f}]" for x, y in self.robot.footprint.corners)
        return f"[{corners}]" if corners else ""

    @cached_property
    def resolution(self) -> Figure:
        """Return the side of a map cell, m."""
        wanted = self.robot.circumscribed_radius / CELLS_PER_RADIUS
        cell = next((cell for cell in CELLS if cell <= wanted * (1 + 1e-9)), CELLS[-1])
        return Figure(
            cell, f"at least three cells in the footprint's radius: {short(wanted)}; 0.05 is enough"
        )

    @cached_property
    def speed(self) -> Figure:
        """Return the maximum forward speed, m/s."""
        robot, visible_speed = self.robot, self.visible_speed
        reason = f"drive.max_speed {short(robot.drive.max_speed)}, limited by the loaded motors,"
        reason += f" {short(max_wheel_speed(robot))}"
        if visible_speed.number < max_speed(robot):
            return Figure(rounded_down(visible_speed.number), f"{visible_speed.derivation}; {reason}")
        return Figure(rounded_down(max_speed(robot)), reason)

    @cached_property
    def visible_speed(self) -> Figure:
        """Return the maximum speed from which the robot stops within its range of view, m/s: v t + v^2 / 2a = d."""
        scan_sensor, a = self.scan_sensor, self.acceleration.number
        distance = max(scan_sensor.range_max - self.radius.number, 0.0)
        t = 1.0 / scan_sensor.rate + 1.0 / MIN_FREQUENCY
        v = a * (math.sqrt(t * t + 2.0 * distance / a) - t)
        return Figure(
            v,
            f"stops within the {short(distance)} m that the {scan_sensor.sensor} covers ahead, with"
            f" {short(a)} m/s^2 after {short(t)} s: {short(v)}",
        )

    @cached_property
    def turn(self) -> Figure:
        """Return the maximum turn rate on the spot, rad/s."""
        robot = self.robot
        return self._on_spot("max_turn", max_turn(robot), "wheel speed", max_wheel_speed(robot))

    @cached_property
    def acceleration(self) -> Figure:
        """Return the maximum forward acceleration, m/s^2."""
        wanted = short(self.robot.drive.max_acceleration)
        return Figure(
            rounded_down(max_acceleration(self.robot)),
            f"the minimum of drive.max_acceleration {wanted}, grip and torque",
        )

    @cached_property
    def turn_acceleration(self) -> Figure:
        """Return the maximum angular acceleration on the spot, rad/s^2."""
        limit, wheel = max_turn_acceleration(self.robot), max_acceleration(self.robot)
        return self._on_spot("max_turn_acceleration", limit, "max_acceleration", wheel)

    @cached_property
    def deceleration(self) -> Figure:
        """Return the deceleration of a stop, m/s^2."""
        return Figure(
            rounded_down(max_deceleration(self.robot)),
            "a stop: drive.max_deceleration, else a part of grip; planned braking is softer",
        )

    @cached_property
    def turn_deceleration(self) -> Figure:
        """Return the angular deceleration of a stop, rad/s^2."""
        return Figure(rounded_down(max_turn_deceleration(self.robot)), "harder by the same factor as forward")

    def _on_spot(self, name: str, limit: float, of_wheel: str, wheel: float) -> Figure:
        """Return a limit of turns on the spot: `drive.NAME`, or less if the motion `wheel` of a wheel allows less."""
        wanted, rims = getattr(self.robot.drive, name), turn_rate_on_spot(self.robot, wheel)
        reason = f"drive.{name} {short(wanted)}, limited by 2 x {of_wheel} / separation = {short(rims)}"
        return Figure(rounded_down(limit), reason)

    @cached_property
    def frequency(self) -> Figure:
        """Return the frequency of the controller, Hz."""
        cells = self.speed.number / self.resolution.number
        hz = min(max(5.0 * math.ceil(2.0 * cells / 5.0), MIN_FREQUENCY), MAX_FREQUENCY)
        return Figure(
            hz,
            f"twice per cell at full speed: 2 x {short(self.speed.number)} / {short(self.resolution.number)} ="
            f" {short(2 * cells)}, in steps of 5 from {MIN_FREQUENCY:g} to {MAX_FREQUENCY:g}",
        )

    @cached_property
    def latency(self) -> Figure:
        """Return the delay from an obstacle to a command that considers it, s."""
        old, late = 1.0 / self.scan_sensor.rate, 1.0 / self.frequency.number
        return Figure(old + late, f"a scan may be {short(old)} s old and a command {short(late)} s late")

    @cached_property
    def stopping_distance(self) -> Figure:
        """Return the stopping distance from full speed, m."""
        v, a, t = self.speed.number, self.acceleration.number, self.latency.number
        return Figure(
            v * t + v * v / (2 * a),
            f"v t + v^2 / 2a = {short(v)} x {short(t)} + {short(v)}^2 / (2 x {short(a)})",
        )

    @cached_property
    def horizon(self) -> Figure:
        """Return the look-ahead time of a controller, s: a stop, then a quarter turn on the spot."""
        v, a = self.speed.number, self.acceleration.number
        w, b = self.turn.number, self.turn_acceleration.number
        brake, quarter = v / a, math.pi / 2 / w + w / b
        return Figure(
            self.latency.number + brake + quarter,
            f"latency {short(self.latency.number)} + stop v/a {short(brake)} + a quarter turn pi/2w + w/b"
            f" {short(quarter)} s",
        )

    @cached_property
    def lookahead(self) -> Figure:
        """Return the distance driven within the horizon at full speed, m."""
        v, t = self.speed.number, self.horizon.number
        return Figure(v * t, f"max speed x horizon = {short(v)} x {short(t)}")

    @cached_property
    def inflation(self) -> Figure:
        """Return the inflation radius around obstacles, m."""
        r, s, two = self.radius.number, self.stopping_distance.number, 2 * self.resolution.number
        return Figure(
            r + s + two,
            f"radius {short(r)} + stopping distance {short(s)} + two cells {short(two)}: outside, the robot can drive"
            " at full speed and stop before contact",
        )

    @cached_property
    def cost_scaling(self) -> Figure:
        """Return the exponential decay of inflated costs, 1/m."""
        beyond = self.inflation.number - self.radius.number
        return Figure(
            EDGE / beyond,
            f"costs fall by e^-{EDGE:g} over the {short(beyond)} m between footprint and inflation_radius",
        )

    @cached_property
    def local_costmap_side(self) -> Figure:
        """Return the side of the local costmap, m."""
        half = self.lookahead.number + self.inflation.number
        return Figure(
            2 * half,
            f"2 x (look-ahead {short(self.lookahead.number)} + inflation {short(self.inflation.number)})"
            f" = {short(2 * half)}, rounded up to metres",
        )

    @cached_property
    def obstacle_range(self) -> Figure:
        """Return the maximum range of returns that mark obstacles, m."""
        corner = self.local_costmap_side.number / math.sqrt(2.0)
        useful, far = self.scan_sensor.range_max, self.scan_sensor.far
        return Figure(
            min(useful, max(corner, 2.0)),
            f"the local costmap's corner, {short(corner)} m, 2 m at least; accurate range of the"
            f" {self.scan_sensor.sensor}: {short(useful)} of {short(far)} m",
        )

    @cached_property
    def obstacle_height(self) -> Figure:
        """Return the height above which obstacles are ignored, m."""
        high = max(overall_height(self.robot), self.scan_sensor.height) + self.resolution.number
        return Figure(high, f"the loaded robot's height {short(overall_height(self.robot))} and a cell")

    @cached_property
    def goal_tolerance(self) -> Figure:
        """Return the position tolerance of a goal, m."""
        return Figure(2 * self.resolution.number, "two cells: the accuracy of localization on a grid")

    @cached_property
    def goal_yaw_tolerance(self) -> Figure:
        """Return the yaw tolerance of a goal, rad."""
        wanted = self.resolution.number / self.radius.number
        return Figure(
            min(wanted, 0.25),
            f"the edge of the footprint is within one cell: resolution / radius = {short(wanted)}",
        )


class Figure(NamedTuple):
    """A number with its derivation in a sentence."""

    number: float
    derivation: str

    def explained(self, reason: str = "") -> Explained:
        """Return the rounded number as a parameter with its reason."""
        return Explained(rounded(self.number), f"{reason}: {self.derivation}" if reason else self.derivation)

    def limit(self, reason: str = "", sign: float = 1.0) -> Explained:
        """Return the number as a parameter whose magnitude does not grow by rounding."""
        return Explained(sign * self.number, f"{reason}: {self.derivation}" if reason else self.derivation)

    def times(self, factor: float, reason: str) -> Explained:
        """Return a multiple of the number as a parameter."""
        return Explained(rounded(factor * self.number), reason)
