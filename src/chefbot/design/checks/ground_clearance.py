"""Floor, clearance and the wheels' openings in the base plate."""

from __future__ import annotations

import math
from collections.abc import Iterator

from chefbot.design.checks.finding import Bound, Finding, below, mm_up
from chefbot.design.checks.overlaps import keys_of
from chefbot.design.checks.part_bodies import PartBody, bodies
from chefbot.design.sizing.sizing import smallest_wheel
from chefbot.robot.geometry import layout
from chefbot.robot.spec import Robot

CONTACT = 1e-4
"""Metres within which a wheel's lowest point is on the floor."""
WHEEL_GAP = 0.001
"""Minimum clearance of a wheel in its notch, m, for a bent shaft or a thread."""
STANDS = ("wheel", "caster")
"""Kinds of parts that touch the floor."""


def check_ground_clearance(robot: Robot) -> Iterator[Finding]:
    """Return all findings about the clearance between base plate and floor."""
    yield from _on_the_floor(robot)
    yield from _clearance(robot)
    yield from _notch(robot)


def _on_the_floor(robot: Robot) -> Iterator[Finding]:
    """Wheels must reach the floor, casters must not lift them off it."""
    for body in bodies(robot):
        low = float(body.low[2])
        if body.part.kind == "wheel" and abs(low) > CONTACT:
            sentence = f"{body.name} ends {1000 * low:.3g} mm above the floor"
            yield Finding(
                "error", "floor", body.name, sentence, abs(low), CONTACT, "m", False, "wheels.diameter", ""
            )
        if body.part.kind == "caster":
            sentence = f"{body.name} reaches below the floor and lifts the wheels"
            yield from below("floor", body.name, sentence, Bound(low, 0.0, "m"), "casters.radius", "")


def _clearance(robot: Robot) -> Iterator[Finding]:
    """Clearance of the plate and of hanging parts; the sizing checks cover the motor."""
    wanted = robot.body.clearance
    others = {body.part.kind: body for body in bodies(robot) if body.part.link == "base_link"}
    for kind, body in others.items():
        low = float(body.low[2])
        if kind in STANDS or kind == "motor" or low >= wanted:
            continue
        key, value = _higher(robot, body, wanted - low)
        sentence = f"below {body.name} there is less than body.clearance"
        yield from below("clearance", body.name, sentence, Bound(low, wanted, "m"), key, value)


def _higher(robot: Robot, body: PartBody, lack: float) -> tuple[str, str]:
    """Key and value that raise the body by `lack` metres: the sensor's mount or the wheel diameter."""
    heights = [key for key in keys_of(robot, body.part) if key.endswith("mount.z")]
    if heights:
        return heights[0], mm_up(body.part.at[2] + lack)
    diameter = max(robot.wheels.diameter + 2.0 * lack, smallest_wheel(robot))
    return "wheels.diameter", mm_up(diameter)


def _notch(robot: Robot) -> Iterator[Finding]:
    """The chapter's rule for the slot, and the clearance of the wheel where it passes the plate."""
    half, inner = half_chord(robot), robot.wheels.inner_face
    if half <= 0.0:
        return
    notch, wheel = robot.plates.notch, robot.wheels.diameter
    if notch is None and inner >= robot.body.plate.half_width + WHEEL_GAP:
        return
    length = notch.length if notch else 0.0
    longest = max(wheel, 2.0 * (half + WHEEL_GAP))
    depth = math.ceil(1000.0 * (layout.wheel_recess(robot) + WHEEL_GAP) - 1e-6) / 1000.0
    gaps = (
        ("base_plate", "the notch is shorter than the wheel", length, wheel, "plates.notch.length", longest),
        ("base_plate, wheel", "the wheel has too little clearance before and behind it",
         length / 2 - half, WHEEL_GAP, "plates.notch.length", longest),
        ("base_plate, wheel", "the wheel's inner side has too little air beside the plate",
         inner - layout.notch_floor(robot), WHEEL_GAP, "plates.notch.depth", depth),
        ("motor_clamp, wheel", "the wheel has too little air beside its motor clamp",
         inner - layout.clamp_front(robot), WHEEL_GAP, "wheels.gap", WHEEL_GAP),
    )  # fmt: skip
    for subject, sentence, have, minimum, key, value in gaps:
        yield from below("notch", subject, sentence, Bound(have, minimum, "m"), key, mm_up(value))


def half_chord(robot: Robot) -> float:
    """Return half of the wheel's chord at the base plate, m; 0 if the wheel stays below the plate."""
    radius, low = robot.wheel_radius, layout.plate_undersides(robot)[0]
    height = min(max(radius, low), low + robot.plates.thickness)
    return math.sqrt(max(radius**2 - (height - radius) ** 2, 0.0)) if height < 2.0 * radius else 0.0
