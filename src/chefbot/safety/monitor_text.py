"""Sentences of the collision monitor: which sensor sees what, where, and how far away."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.safety.contact_time import distance_from_body
from chefbot.safety.monitor_polygons import MonitorPolygons

STOPPED_SHARE = 0.05
"""Share of the commanded motion below which the robot counts as stopped."""
MIN_DRIVING_SPEED = 1e-3
"""Speed, m/s, from which the robot drives rather than rotates in place."""
MAX_PRESENT_AGE = 0.5
"""Age from which a point is one that was seen rather than is, s."""
REPEAT_NS = 500_000_000
"""Minimum time between two sentences that differ only in what they name, ns."""
SECTORS = (
    "ahead", "ahead on the left", "on the left", "behind on the left", "behind",
    "behind on the right", "on the right", "ahead on the right",
)  # fmt: skip
"""Eighths of a turn about the robot, from ahead to the left."""


class SensedPoint(NamedTuple):
    """A point that a sensor measured: the sensor's name, its position in base_link (m) and its age (s)."""

    sensor: str
    x: float
    y: float
    age: float


def direction_text(x: float, y: float) -> str:
    """Return where a point in base_link is."""
    return SECTORS[round(math.atan2(y, x) / (math.pi / 4.0)) % len(SECTORS)]


def obstacle_text(point: SensedPoint, polygons: MonitorPolygons) -> str:
    """Return what limits a twist: "the lidar sees an obstacle 0.12 m ahead on the left"."""
    distance = max(0.0, distance_from_body(point.x, point.y, polygons.circumscribed, polygons.corners))
    verb = "sees" if point.age < MAX_PRESENT_AGE else "saw"
    ago = (
        ""
        if point.age < MAX_PRESENT_AGE
        else f", {point.age:.0f} s ago"
        if point.age >= 1.0
        else ", a moment ago"
    )
    return f"the {point.sensor} {verb} an obstacle {distance:.2f} m {direction_text(point.x, point.y)}{ago}"


def unseen_text(v: float) -> str:
    """Return how ground that no sensor has seen recently limits a twist of the forward speed `v`, m/s."""
    where = "behind" if v < -MIN_DRIVING_SPEED else "beside" if v < MIN_DRIVING_SPEED else "ahead of"
    return f"no sensor has recently seen the ground {where} the robot"


def limited_text(limit: str, commanded: tuple[float, float], left: tuple[float, float]) -> str:
    """Return the sentence about a limit of a commanded twist (m/s, rad/s) of which the wheels get what is left."""
    amount = abs(commanded[0]) + abs(commanded[1])
    if not limit or amount == 0.0:
        return ""
    stands = abs(left[0]) + abs(left[1]) < STOPPED_SHARE * amount
    return f"{'Stopped' if stands else 'Slowed'}: {limit}."


class ReasonKeeper:
    """Keeps the reason why the robot moves less than commanded, a sentence, and limits how often it changes."""

    def __init__(self) -> None:
        self.sentence = ""
        self._changed_ns = 0

    def changes(self, sentence: str, now_ns: int) -> bool:
        """Set the sentence; return whether it is to be published now. Its beginning and its end never wait."""
        if sentence == self.sentence:
            return False
        if sentence and self.sentence and now_ns - self._changed_ns < REPEAT_NS:
            return False
        self.sentence, self._changed_ns = sentence, now_ns
        return True
