"""The robot as rigid links: where its masses are and which simple solids stand for them.

URDF and MJCF are both written from here, so that they cannot disagree.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from chefbot.robot.spec import Robot

HEAVY_SHARE = 0.6
"""Share of the body's mass that lies on the base plate (battery, motors); the rest is spread upwards."""
PLATE_THICKNESS = 0.005  # m, plywood or acrylic
POLE_RADIUS = 0.007  # m
POLES_AT = 0.85  # of the plates' radius
PAYLOAD_RADIUS = 0.8  # of the plates' radius: trays and boxes do not overhang
CASTER_GAP = 0.0005
"""Metres between the casters and a level floor. Four rigid supports in one plane would leave it to chance
which of them carries; with this gap no wheel is lifted and odometry does not depend on the solver."""

Vector = tuple[float, float, float]
Kind = Literal["cylinder", "sphere", "wheel"]


class Inertia(NamedTuple):
    """Mass in kg, centre in the link's frame in metres, moments about the centre's axes in kg m^2."""

    mass: float
    centre: Vector
    moments: Vector


class Solid(NamedTuple):
    """A primitive in its link's frame, metres.

    size: of cylinder and wheel (radius, length), of a sphere (radius,).
    A cylinder stands along z, a wheel lies along y. `hull` solids collide, the others are only seen.
    """

    name: str
    kind: Kind
    at: Vector
    size: tuple[float, ...]
    hull: bool


class Link(NamedTuple):
    """A rigid part: its origin in base_link, and whether it turns about its y axis (a wheel) or is fixed."""

    name: str
    at: Vector
    inertia: Inertia
    solids: tuple[Solid, ...]
    turns: bool = False


def links(robot: Robot) -> list[Link]:
    """All links that have mass, base_link first; its origin is on the floor below the axle's middle."""
    return [_base(robot), _payload(robot), _wheel(robot, "left", 1.0), _wheel(robot, "right", -1.0)]


def cylinder_moments(mass: float, radius: float, length: float) -> Vector:
    """Solid cylinder along z about its centre (Goldstein, Classical Mechanics, ch. 5)."""
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    return across, across, mass * radius**2 / 2.0


def caster_positions(robot: Robot) -> dict[str, Vector]:
    """Name of the caster to the centre of its ball in base_link."""
    z = robot.casters.radius + CASTER_GAP
    return {"front": (robot.casters.offset, 0.0, z), "back": (-robot.casters.offset, 0.0, z)}


def _base(robot: Robot) -> Link:
    """Plates, poles, motors, battery and casters: everything but wheels and payload."""
    body = robot.body
    low, length = body.clearance, body.height - body.clearance
    hull = Solid("hull", "cylinder", (0.0, 0.0, low + length / 2), (body.radius, length), True)
    casters = [
        Solid(f"caster_{name}", "sphere", at, (robot.casters.radius,), True)
        for name, at in caster_positions(robot).items()
    ]
    return Link(
        "base_link", (0.0, 0.0, 0.0), _base_inertia(robot), (hull, *casters, *_plates(robot), *_poles(robot))
    )


def _base_inertia(robot: Robot) -> Inertia:
    """A heavy disc at axle height and a light cylinder over the whole height (parallel-axis theorem)."""
    body = robot.body
    mass = body.mass - 2.0 * robot.wheels.mass
    heavy, light = HEAVY_SHARE * mass, (1.0 - HEAVY_SHARE) * mass
    low, middle = max(robot.wheel_radius, body.clearance), (body.clearance + body.height) / 2
    centre = (heavy * low + light * middle) / mass
    disc = cylinder_moments(heavy, body.radius, PLATE_THICKNESS)
    column = cylinder_moments(light, body.radius, body.height - body.clearance)
    shift = heavy * (low - centre) ** 2 + light * (middle - centre) ** 2
    across = disc[0] + column[0] + shift
    return Inertia(mass, (0.0, 0.0, centre), (across, across, disc[2] + column[2]))


def plate_heights(robot: Robot) -> tuple[float, float, float]:
    """Middle of base, middle and top plate above the floor."""
    low = robot.body.clearance + PLATE_THICKNESS / 2
    high = robot.body.height - PLATE_THICKNESS / 2
    return low, (low + high) / 2, high


def _plates(robot: Robot) -> list[Solid]:
    size = (robot.body.radius, PLATE_THICKNESS)
    heights = zip(("base", "middle", "top"), plate_heights(robot), strict=True)
    return [Solid(f"plate_{name}", "cylinder", (0.0, 0.0, z), size, False) for name, z in heights]


def _poles(robot: Robot) -> list[Solid]:
    reach = POLES_AT * robot.body.radius * math.sqrt(0.5)
    length = robot.body.height - robot.body.clearance
    middle = robot.body.clearance + length / 2
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return [
        Solid(f"pole_{i}", "cylinder", (sx * reach, sy * reach, middle), (POLE_RADIUS, length), False)
        for i, (sx, sy) in enumerate(corners)
    ]


def _payload(robot: Robot) -> Link:
    body = robot.body
    radius, height = PAYLOAD_RADIUS * body.radius, body.payload_height
    centre = (0.0, 0.0, height / 2)
    solid = Solid("payload", "cylinder", centre, (radius, height), True)
    inertia = Inertia(body.payload, centre, cylinder_moments(body.payload, radius, height))
    return Link("payload_link", (0.0, 0.0, body.height), inertia, (solid,))


def _wheel(robot: Robot, side: str, sign: float) -> Link:
    wheels, radius = robot.wheels, robot.wheel_radius
    across, _, along = cylinder_moments(wheels.mass, radius, wheels.width)
    solid = Solid(f"wheel_{side}", "wheel", (0.0, 0.0, 0.0), (radius, wheels.width), True)
    at = (0.0, sign * wheels.separation / 2, radius)
    return Link(
        f"wheel_{side}_link",
        at,
        Inertia(wheels.mass, (0.0, 0.0, 0.0), (across, along, across)),
        (solid,),
        True,
    )


def sensor_mounts(robot: Robot) -> dict[str, tuple[Vector, float, float]]:
    """Frame name to (position in base_link, pitch, yaw) of every mounted sensor."""
    sensors = robot.sensors
    named = {
        "imu_link": sensors.imu,
        "ultrasonic_link": sensors.ultrasonic,
        "camera_link": sensors.depth_camera,
        "laser": sensors.lidar,
    }
    mounts = {name: sensor.mount for name, sensor in named.items() if sensor is not None}
    return {name: ((m.x, m.y, m.z), m.pitch, m.yaw) for name, m in mounts.items()}
