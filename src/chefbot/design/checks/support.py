"""Support of equipment and sensors: on their plate, below the next plate, connected to other parts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from chefbot.design.checks.finding import Bound, Finding, below, mm_down, mm_up
from chefbot.design.checks.overlaps import keys_of
from chefbot.design.checks.part_bodies import PAIRS, PartBody, bodies, room_of_box
from chefbot.robot.geometry import layout
from chefbot.robot.plate_shape import RectangularPlate
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from manifold3d import CrossSection

CONTACT_TOLERANCE = 1e-4
"""Metres between parts that touch."""
PRESS = 1e-5
"""Distance below a foot at which its support is searched, m."""
MIN_SUPPORT = 0.25
"""Minimum supported share of the foot of a box or stand; its middle must be supported too."""
REST = ("wheel", "payload")
"""Kinds of parts that are fixed and need no support from below."""


def check_support(robot: Robot) -> Iterator[Finding]:
    """Return all findings about equipment and sensors that do not rest on their plates."""
    found = bodies(robot)
    floating = _floating(found)
    for body in found:
        if body.part.material in ("equipment", "sensor"):
            yield from _edge(robot, body)
        if body.part.material == "equipment":
            yield from _bay(robot, body)
            yield from _foot(robot, body, found)
        elif body.part.kind == "stand":
            yield from _foot(robot, body, found)
        if body.name in floating:
            yield _nothing_holds(robot, body)


def _bay(robot: Robot, body: PartBody) -> Iterator[Finding]:
    """A box must fit below the next plate."""
    top = float(body.high[2])
    above = [low for low in layout.plate_undersides(robot) if low > body.low[2]]
    if above:
        height = top - float(body.low[2])
        yield from below(
            "bay", body.name, f"{body.name} is {1000 * height:.4g} mm high: too high for the tubes",
            Bound(min(above) - float(body.low[2]), height, "m"), "tubes.length", mm_up(height),
        )  # fmt: skip


def _edge(robot: Robot, body: PartBody) -> Iterator[Finding]:
    """The corners of a box must be inside the body, which is the planner's footprint."""
    if isinstance(robot.body.plate, RectangularPlate):
        yield from _edge_of_rectangle(robot, body)
        return
    x, y = (max(abs(float(body.low[i])), abs(float(body.high[i]))) for i in (0, 1))
    key = keys_of(robot, body.part)[0 if x >= y else 1]
    corner, radius = math.hypot(x, y), robot.body.plate.front
    yield from below(
        "edge", body.name, f"a corner of {body.name} is {1000 * corner:.4g} mm from the middle: beyond the plate",
        Bound(radius, corner, "m"), key, _inwards(robot, body, 0 if x >= y else 1),
    )  # fmt: skip


def _edge_of_rectangle(robot: Robot, body: PartBody) -> Iterator[Finding]:
    room = room_of_box(robot, body)
    sentence = f"a corner of {body.name} stands {-1000 * room:.4g} mm beyond the plate"
    yield from below("edge", body.name, sentence, Bound(room, 0.0, "m"), keys_of(robot, body.part)[0], "")


def _inwards(robot: Robot, body: PartBody, axis: int) -> str:
    """Coordinate at which the outer corners are on the plate; empty if the box is too large."""
    half = (body.high - body.low) / 2.0
    other = 1 - axis
    across = max(abs(float(body.low[other])), abs(float(body.high[other])))
    radius = robot.body.plate.front
    if across >= radius:
        return ""
    reach = math.sqrt(radius**2 - across**2) - float(half[axis])
    if reach < 0.0:
        return ""
    middle = float(body.low[axis] + body.high[axis]) / 2.0
    return mm_down(reach) if middle >= 0.0 else f"-{mm_down(reach)}"


def _foot(robot: Robot, body: PartBody, found: tuple[PartBody, ...]) -> Iterator[Finding]:
    """The foot must be supported, its middle too; a stand may be fixed from above instead."""
    shares = [_supported(body, found, above) for above in (False, True)]
    share = max(shares) if body.part.kind == "stand" else shares[0]
    keys = keys_of(robot, body.part)
    sentence = f"{body.name} stands over a hole or the edge: {100 * share:.3g} % of its foot lie on something"
    yield from below("seat", body.name, sentence, Bound(share, MIN_SUPPORT, ""), keys[0], "")


def _supported(body: PartBody, found: tuple[PartBody, ...], above: bool) -> float:
    """Supported share of the foot (or head); 0 if its middle is outside the hull of the support."""
    from manifold3d import CrossSection, OpType

    level = float(body.high[2] if above else body.low[2])
    foot = body.surface.slice(level + (-PRESS if above else PRESS))
    beyond = level + (PRESS if above else -PRESS)
    others = [other for other in found if other.low[2] < beyond < other.high[2] and other.name != body.name]
    supports = [foot ^ other.surface.slice(beyond) for other in others if _over(body, other)]
    held = CrossSection.batch_boolean([CrossSection(), *supports], OpType.Add)
    if held.is_empty() or not _inside(held.hull(), (body.low[:2] + body.high[:2]) / 2.0):
        return 0.0
    return float(held.area() / foot.area())


def _over(one: PartBody, other: PartBody) -> bool:
    return bool(np.all(one.low[:2] < other.high[:2]) and np.all(other.low[:2] < one.high[:2]))


def _inside(section: CrossSection, point: np.ndarray) -> bool:
    """Whether a point is in a convex section."""
    (loop,) = section.to_polygons()
    side = np.roll(loop, -1, axis=0) - loop
    away = point - loop
    return bool(np.all(side[:, 0] * away[:, 1] - side[:, 1] * away[:, 0] >= 0.0))


def _floating(found: tuple[PartBody, ...]) -> set[str]:
    """Parts without a chain of contacts to the base plate."""
    left = {body.name: body for body in found if body.part.kind not in REST}
    reached = [left.pop("base_plate")]
    while reached:
        body = reached.pop()
        near = [other.name for other in left.values() if _touch(body, other)]
        reached.extend(left.pop(name) for name in near)
    return set(left)


@lru_cache(PAIRS)  # the robots that are compared while a remedy is sought share most of their parts
def _touch(one: PartBody, other: PartBody) -> bool:
    """A tilted sensor is fixed to its stand, which ends below the middle of the housing."""
    if f"{one.name}_stand" == other.name or f"{other.name}_stand" == one.name:
        return True
    if np.any(one.low > other.high + CONTACT_TOLERANCE) or np.any(other.low > one.high + CONTACT_TOLERANCE):
        return False
    return one.surface.min_gap(other.surface, 2.0 * CONTACT_TOLERANCE) <= CONTACT_TOLERANCE


def _nothing_holds(robot: Robot, body: PartBody) -> Finding:
    keys = keys_of(robot, body.part)
    key = next((key for key in keys if key.endswith(".z")), keys[0] if keys else body.part.kind)
    sentence = f"{body.name} floats: it touches nothing that is joined to the base plate"
    return Finding("error", "seat", body.name, sentence, 0.0, MIN_SUPPORT, "", True, key, "")
