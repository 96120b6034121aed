"""Checks of motors, driver, battery and stability by the design sheet, as findings with suggested values."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import msgspec

from chefbot.design.checks.finding import Bound, Finding, Severity, below, mm_up
from chefbot.design.sizing.dependent_dimensions import with_motor
from chefbot.design.sizing.energy_budget import run_time
from chefbot.design.sizing.forces import CARPET_RESISTANCE, force, grip, worst
from chefbot.design.sizing.requirements import (
    SPEED_RESERVE,
    TIPS_LESS,
    WHEEL,
    Check,
    judge,
    turn_rate,
    wheel_speed,
)
from chefbot.design.sizing.sizing import smallest_wheel
from chefbot.design.sizing.stability import Load, loaded
from chefbot.design.sizing.suggested_fixes import stable_radius
from chefbot.robot.catalogue import Catalogue
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.geometry.solids import solids
from chefbot.robot.spec import GRAVITY, Robot

SEEN_ELSEWHERE = "room round it"
"""Checks that the design sheet estimates and the solids decide."""
FIXED_OUTSIDE = ("driver", "input level without a level shifter")
"""Checks that a part outside the robot file repairs: a level shifter."""
NO_OTHER = (
    "; replacing a single part from the catalogue does not fix it: `chefbot robot design` tries all sets"
)
NAMED_PARTS = 5


def check_drive(robot: Robot, catalogue: Catalogue) -> Iterator[Finding]:
    """Return the failed sizing checks, and a finding if the mass exceeds its budget."""
    load = loaded(robot)
    for check in judge(robot, load):
        if not check.passed and check.name != SEEN_ELSEWHERE:
            yield _finding(robot, check, load, catalogue)
    yield from _budget(robot)


def _finding(robot: Robot, check: Check, load: Load, catalogue: Catalogue) -> Finding:
    severity: Severity = "warning" if (check.part, check.name) == FIXED_OUTSIDE else "error"
    rule = "stability" if check.part == "robot" else "drive"
    key, sentence = check.key, f"{check.part}: {check.name}"
    value = REMEDIES[key](robot, load, catalogue)
    if not value and check.name in LESS:
        key, less = LESS[check.name]
        value = less(robot, load)
    if not value:
        sentence += NO_OTHER
    return Finding(
        severity, rule, check.part, sentence, check.have, check.bound, check.unit, check.at_least, key, value
    )


def _budget(robot: Robot) -> Iterator[Finding]:
    """The mass of the solids against the budget of the design sheet."""
    heaviest: dict[str, float] = {}
    for part in solids(robot):
        heaviest[part.kind] = heaviest.get(part.kind, 0.0) + part.mass
    ordered = sorted(heaviest, key=lambda kind: -heaviest[kind])[:NAMED_PARTS]
    named = ", ".join(f"{kind} {1000 * heaviest[kind]:.0f} g" for kind in ordered)
    budget, mass = robot.body.mass_budget, unloaded_mass(robot)
    value = f"{math.ceil(10.0 * mass - 1e-9) / 10.0:g} kg"
    yield from below(
        "mass", "robot", f"the robot weighs {mass:.3g} kg without payload; most: {named}",
        Bound(budget, mass, "kg"), "body.mass_budget", value, "warning",
    )  # fmt: skip


# -- what would do


def _fitting(robot: Robot, part: str, entries: dict[str, Any]) -> str:
    """The lightest component with which the part's checks pass, and as many others as now."""
    now = sum(1 for check in judge(robot, loaded(robot)) if not check.passed and check.part != part)
    for name in sorted(entries, key=lambda name: entries[name].mass):
        candidate = _exchanged(robot, part, entries[name])
        failing = [check for check in judge(candidate, loaded(candidate)) if not check.passed]
        own = [check for check in failing if check.part == part]
        if not own and len(failing) <= now:
            return name
    return ""


def _exchanged(robot: Robot, part: str, component: Any) -> Robot:
    if part == "motor":
        return with_motor(robot, component)
    return msgspec.structs.replace(robot, **{part: component})


def _separation(robot: Robot) -> str:
    room = robot.motor.length + robot.motor_clamp.thickness + robot.wheels.gap + robot.wheels.width / 2.0
    return mm_up(2.0 * room)


def _turn(robot: Robot, load: Load) -> str:
    rate = math.floor(100.0 * turn_rate(robot, load.mass)) / 100.0
    return f"{rate:g} rad/s" if rate > 0.0 else ""


def _acceleration(robot: Robot, load: Load) -> str:
    """Acceleration that the grip permits on the steepest ramp."""
    slope = robot.drive.max_slope
    held = grip(robot, load.mass, slope).value / load.mass
    left = held - GRAVITY * (math.sin(slope) + CARPET_RESISTANCE * math.cos(slope))
    best = math.floor(100.0 * left) / 100.0
    return f"{best:g} m/s^2" if best > 0.0 else ""


def _slope(robot: Robot, load: Load) -> str:
    """Maximum slope without slip, in full degrees."""
    duty = worst(robot)
    for degrees in range(math.floor(math.degrees(robot.drive.max_slope)), -1, -1):
        slope = math.radians(degrees)
        if grip(robot, load.mass, slope).value >= force(load.mass, duty._replace(slope=slope)).value:
            return f"{degrees} deg"
    return ""


def _speed(robot: Robot, load: Load) -> str:
    """Maximum speed of the motors with the reserve."""
    speed = wheel_speed(robot, load.mass) * robot.wheel_radius / SPEED_RESERVE
    return f"{math.floor(100.0 * speed) / 100.0:g} m/s" if speed >= 0.01 else ""


def _run_time(robot: Robot, load: Load) -> str:
    return f"{math.floor(run_time(robot, load.mass).value / 60.0):g} min"


def _radius(robot: Robot) -> str:
    radius = stable_radius(robot)
    return "" if radius is None else mm_up(radius)


REMEDIES: dict[str, Callable[[Robot, Load, Catalogue], str]] = {
    "motor": lambda robot, _, catalogue: _fitting(robot, "motor", catalogue.motors),
    "driver": lambda robot, _, catalogue: _fitting(robot, "driver", catalogue.drivers),
    "battery": lambda robot, _, catalogue: _fitting(robot, "battery", catalogue.batteries),
    WHEEL: lambda robot, *_: mm_up(smallest_wheel(robot)),
    "wheels.separation": lambda robot, *_: _separation(robot),
    "drive.max_turn": lambda robot, load, _: _turn(robot, load),
    "drive.max_acceleration": lambda robot, load, _: _acceleration(robot, load),
    TIPS_LESS: lambda robot, *_: _radius(robot),
}
"""Key to a value with which the check passes."""
LESS: dict[str, tuple[str, Callable[[Robot, Load], str]]] = {
    "speed with reserve": ("drive.max_speed", _speed),
    "run time": ("power.run_time", _run_time),
    "grip on the ramp": ("drive.max_slope", _slope),
}
"""Name of a check to the requirement that can be relaxed if no component is better."""
