"""Overlaps between parts, found by boolean operations on the solids."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache, partial
from itertools import combinations, islice
from typing import NamedTuple

import numpy as np

from chefbot.design.checks.finding import Finding, nearest_valid_length
from chefbot.design.checks.part_bodies import PAIRS, PartBody, bodies, named, room_of_box
from chefbot.robot.geometry.solids import RobotPart
from chefbot.robot.spec import Robot

TOLERANCE = 1e-9
"""Cubic metres (1 mm^3): contact is permitted, and polygons approximate arcs."""
MAX_FIXES = 8
"""Maximum number of overlaps with a suggested value."""
CLIFF = "cliff_"
FRAMES = {
    "imu": "imu",
    "ultrasonic": "ultrasonic",
    "camera": "depth_camera",
    "color_camera": "color_camera",
    "laser": "lidar",
}
"""Name of a sensor's part to its key."""
WAYS = {
    "caster": ("casters.offset",),
    "pole": ("poles.reach",),
    "tube": ("poles.reach",),
    "wheel": ("wheels.separation",),
    "motor_clamp": ("motor_clamp.width", "motor_clamp.length"),
    "motor": ("wheels.separation",),
    "payload": ("body.payload_height",),
}
"""Kind of a part to the keys that move it."""


class Overlap(NamedTuple):
    """Two overlapping bodies, their common volume in m^3 and the sides of its bounding box in metres."""

    one: PartBody
    other: PartBody
    volume: float
    size: tuple[float, float, float]


def overlapping(robot: Robot) -> Iterator[Overlap]:
    """Return all pairs of bodies that share more than TOLERANCE."""
    for one, other in combinations(bodies(robot), 2):
        found = overlap(one, other)
        if found is not None:
            yield found


@lru_cache(PAIRS)  # the robots that are compared while a remedy is sought share most of their parts
def overlap(one: PartBody, other: PartBody) -> Overlap | None:
    """Return the overlap of two bodies, None if it is not larger than TOLERANCE."""
    if np.any(one.high <= other.low) or np.any(other.high <= one.low):
        return None
    shared = one.surface ^ other.surface
    volume = float(shared.volume())
    if volume <= TOLERANCE:
        return None
    box = np.array(shared.bounding_box())
    x, y, z = (box[3:] - box[:3]).tolist()
    return Overlap(one, other, volume, (x, y, z))


def overlaps(robot: Robot) -> Iterator[Finding]:
    """Return a finding for each overlapping pair, with the nearest free place of the part that can move."""
    found = sorted(overlapping(robot), key=lambda pair: -pair.volume)
    for i, pair in enumerate(found):
        lighter, heavier = sorted((pair.one.part, pair.other.part), key=lambda part: part.mass)
        keys = keys_of(robot, lighter) + keys_of(robot, heavier)
        if {"base_plate", "wheel"} <= {pair.one.part.kind, pair.other.part.kind}:
            continue  # the check of the notch reports it
        key, value = _remedy(robot, pair, keys, len(found)) if i < MAX_FIXES else ("", "")
        x, y, z = (1000.0 * side for side in pair.size)
        yield Finding(
            "error", "overlap", f"{pair.one.name}, {pair.other.name}",
            f"{pair.one.name} and {pair.other.name} are in the same place, over {x:.3g} x {y:.3g} x {z:.3g} mm",
            pair.volume, 0.0, "m^3", False, key or (keys[0] if keys else pair.one.part.kind), value,
        )  # fmt: skip


def _remedy(robot: Robot, pair: Overlap, keys: list[str], before: int) -> tuple[str, str]:
    """Key and value with which both parts are separate and inside the body, without a new overlap."""
    names = pair.one.name, pair.other.name

    def is_valid(candidate: Robot) -> bool:
        both = named(candidate, *names)
        if len(both) == 2 and overlap(*both) is not None:
            return False
        if not all(map(partial(_inside, candidate), both)):
            return False
        return len(list(islice(overlapping(candidate), before))) < before

    return nearest_valid_length(robot, keys, is_valid)


def _inside(robot: Robot, box: PartBody) -> bool:
    """Whether all corners are inside the body; wheels and casters are exempt."""
    return box.part.material not in ("equipment", "sensor") or room_of_box(robot, box) >= 0.0


def keys_of(robot: Robot, part: RobotPart) -> list[str]:
    """Return the keys that move a part; boxes and sensors come before what carries them."""
    name = part.name.removesuffix("_stand")
    if name.startswith(CLIFF):
        position = f"sensors.cliffs.positions[{name.removeprefix(CLIFF)}]"
        return [f"{position}.x", f"{position}.y", "sensors.cliffs.height"]
    if name in FRAMES:
        return [f"sensors.{FRAMES[name]}.mount.{axis}" for axis in "xyz"]
    if name in ("battery", "driver"):
        return [f"places.{name}.{axis}" for axis in "xy"]
    for i, item in enumerate(robot.equipment):
        if item.name == name:
            return [f"equipment[{i}].place.{axis}" for axis in "xy"]
    return list(WAYS.get(part.kind, ()))
