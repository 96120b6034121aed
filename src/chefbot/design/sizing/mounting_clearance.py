"""Whether a box fits onto its plate: between edge, poles, other boxes and the plate above."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.robot.geometry import layout
from chefbot.robot.section import MountingPosition, Size
from chefbot.robot.spec import Robot


class ClearanceBox(NamedTuple):
    """A box that is mounted on a plate."""

    place: MountingPosition
    size: Size


def battery_clearance(robot: Robot) -> float:
    """Return the minimum clearance of the battery, m; negative if it overlaps something."""
    others = [*_equipment(robot), ClearanceBox(robot.places.driver, robot.driver.size)]
    return box_clearance(robot, ClearanceBox(robot.places.battery, robot.battery.size), others)


def driver_clearance(robot: Robot) -> float:
    """Return the minimum clearance of the driver, m; an overlap with the battery counts for the battery only."""
    return box_clearance(robot, ClearanceBox(robot.places.driver, robot.driver.size), _equipment(robot))


def box_clearance(robot: Robot, box: ClearanceBox, others: list[ClearanceBox]) -> float:
    """Return the minimum distance to edge, poles, other boxes and ceiling, m; negative if they overlap."""
    place, size = box
    far = abs(place.y) + size.y / 2.0
    edges = ((abs(place.x) + size.x / 2.0, far), (place.x - size.x / 2.0, far))
    distances = [min(robot.body.plate.room(*corner) for corner in edges)]
    if place.plate < robot.plates.count:
        distances.append(robot.tubes.length - size.z)
    if robot.plates.count > 1:
        distances += [_to_point(box, at) - robot.tubes.outer_radius for at in layout.pole_positions(robot)]
    distances += [_between(box, other) for other in others if other.place.plate == place.plate]
    return min(distances)


def _equipment(robot: Robot) -> list[ClearanceBox]:
    return [ClearanceBox(item.place, item.size) for item in robot.equipment]


def _to_point(box: ClearanceBox, at: tuple[float, float]) -> float:
    """From the rectangle to a point; 0 inside."""
    along = max(abs(at[0] - box.place.x) - box.size.x / 2.0, 0.0)
    across = max(abs(at[1] - box.place.y) - box.size.y / 2.0, 0.0)
    return math.hypot(along, across)


def _between(one: ClearanceBox, other: ClearanceBox) -> float:
    """Gap of two rectangles along the axis where it is larger; negative where they overlap."""
    along = abs(one.place.x - other.place.x) - (one.size.x + other.size.x) / 2.0
    across = abs(one.place.y - other.place.y) - (one.size.y + other.size.y) / 2.0
    return max(along, across)
