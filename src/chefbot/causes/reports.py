"""Reports of checks: what a node found, before it is joined with what others found."""

from __future__ import annotations

from typing import NamedTuple

import msgspec

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import Cause, Quantity
from chefbot.msgs.chefbot_msgs.maps import ZONE_TITLES
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.std_msgs import Header

SLOW, STOP, DETOUR, FAILURE, END = "slow", "stop", "detour", "failure", "end"
"""Kinds of causes, by their effect."""
SEVERITY = {SLOW: 0, DETOUR: 1, STOP: 2, FAILURE: 3}
"""Severity of the effects."""
LATENESS_NS = 2_000_000_000
"""Age of a cause from which a list of those that hold has to name it, ns: messages overtake each other."""
LIDAR, CAMERA, RANGER = "lidar", "depth camera", "ultrasonic ranger"
"""Sensors that mark obstacles."""
EMERGENCY_STOP = "emergency stop"
"""The check of the base that a person has pressed STOP."""
TRACKER = "people tracker"
"""What knows where people are, from all sensors."""
CONTACT, MAP = "contact", "map"
"""What else marks an obstacle: the robot touched it, or it is on the static map."""


def is_zone(sensor: str) -> bool:
    """Return whether what marked an obstacle is a zone of the map, such as "keep-out zone stairs"."""
    return sensor.startswith(tuple(f"{title} " for title in ZONE_TITLES.values()))


class MarkedPlace(NamedTuple):
    """A place with an obstacle: sensor or zone that marked it, frame, x, y in it (m), and time of the mark or 0."""

    sensor: str
    frame: str
    x: float
    y: float
    marked_ns: int


def make_report(
    kind: str,
    check: str,
    sentence: str,
    place: MarkedPlace | None = None,
    numbers: tuple[Quantity, ...] = (),
) -> Cause:
    """Return the report of a check: its effect, its name, its sentence, and the place that it found, if any."""
    cause = Cause(kind=kind, check=check, sentence=sentence, numbers=numbers)
    if place is None:
        return cause
    return msgspec.structs.replace(
        cause,
        header=Header.of(0, place.frame),
        sensor=place.sensor,
        located=True,
        point=Point(place.x, place.y, 0.0),
        marked_at=Time.of(place.marked_ns),
    )


def stamped(report: Cause, node: str, now_ns: int) -> Cause:
    """Return a report with its node and its time."""
    header = Header.of(now_ns, report.header.frame_id)
    return msgspec.structs.replace(report, header=header, node=node)
