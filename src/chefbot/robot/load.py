"""Robot files: found by name or path, read, and checked for robots that cannot be."""

from __future__ import annotations

import math
from pathlib import Path

from chefbot.config import read_config
from chefbot.errors import UserError, nearest
from chefbot.robot.spec import Robot

ROBOT_FOLDER = Path(__file__).parent


def built_in_robots() -> dict[str, Path]:
    """Name to file of the robots that come with the package."""
    return {path.stem: path for path in sorted(ROBOT_FOLDER.glob("*.yaml"))}


def load_robot(name_or_path: str) -> Robot:
    """A built-in robot by name, or a file by path. UserError with file, key and reason otherwise."""
    path = _find(name_or_path)
    robot = read_config(path, Robot, "robot file")
    check_possible(robot, f"robot file {path}")
    return robot


def _find(name_or_path: str) -> Path:
    known = built_in_robots()
    if name_or_path in known:
        return known[name_or_path]
    if name_or_path.endswith((".yaml", ".yml")) or "/" in name_or_path:
        return Path(name_or_path)
    raise UserError(
        f"no robot is called {name_or_path!r}{nearest(name_or_path, known)}; give one of these or a file"
    )


def check_possible(robot: Robot, where: str) -> None:
    """UserError for a robot that could not be built or could not move."""
    for impossible, key, reason in _contradictions(robot):
        if impossible:
            raise UserError(f"{where}: {key}: {reason}")


def _contradictions(robot: Robot) -> list[tuple[bool, str, str]]:
    """(does it hold, key, sentence) of everything that cannot be together."""
    body, wheels, radius = robot.body, robot.wheels, robot.wheel_radius
    checks = [
        (
            body.clearance >= wheels.diameter,
            "body.clearance",
            f"{body.clearance:.3g} m is above the wheels' top",
        ),
        (body.clearance >= body.height, "body.clearance", f"{body.clearance:.3g} m is not below body.height"),
        (wheels.separation <= wheels.width, "wheels.separation", "the wheels overlap each other"),
        (
            wheels.separation / 2 - wheels.width / 2 > body.radius + wheels.width,
            "wheels.separation",
            f"the wheels stand clear of the {body.radius:.3g} m plate; make it smaller or body.radius larger",
        ),
        (
            2 * wheels.mass >= body.mass,
            "wheels.mass",
            "two wheels weigh more than the body that they belong to",
        ),
        (
            robot.casters.offset + robot.casters.radius > robot.footprint_radius,
            "casters.offset",
            "the casters stand outside the body",
        ),
        (
            robot.max_wheel_speed <= 0.0,
            "motor.stall_torque",
            f"{robot.motor.stall_torque:.3g} N m per wheel cannot roll {robot.total_mass:.3g} kg at all",
        ),
        (
            robot.battery.empty_voltage >= robot.battery.voltage,
            "battery.empty_voltage",
            "is not below battery.voltage",
        ),
        (radius > body.height, "wheels.diameter", "the wheels are taller than twice the body"),
    ]
    return checks + _sensor_contradictions(robot)


def _sensor_contradictions(robot: Robot) -> list[tuple[bool, str, str]]:
    checks: list[tuple[bool, str, str]] = []
    for name in ("depth_camera", "lidar", "ultrasonic"):
        sensor = getattr(robot.sensors, name)
        if sensor is not None:
            key = f"sensors.{name}"
            checks.append(
                (sensor.range_min >= sensor.range_max, f"{key}.range_min", "is not below range_max")
            )
            outside = math.hypot(sensor.mount.x, sensor.mount.y) > robot.footprint_radius
            checks.append((outside, f"{key}.mount", "sits outside the body"))
            checks.append(
                (
                    not 0 < sensor.mount.z <= robot.body.height,
                    f"{key}.mount.z",
                    "is not between floor and top",
                )
            )
    camera = robot.sensors.depth_camera
    if camera is not None:
        checks.append(
            (
                camera.field_of_view > 2.6,
                "sensors.depth_camera.field_of_view",
                "above 149 degrees is no camera",
            )
        )
        checks.append(
            (camera.width * camera.height > 4_000_000, "sensors.depth_camera.width", "above 4 megapixels")
        )
    if camera is None and robot.sensors.lidar is None:
        checks.append((True, "sensors", "neither depth_camera nor lidar: the robot could not see"))
    return checks
