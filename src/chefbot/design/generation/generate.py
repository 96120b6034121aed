"""Generation of a robot: numbers drawn by a seed, dimensions and parts derived, and everything checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import msgspec
import numpy as np

from chefbot.board.firmware_constants import MAX_NO_LOAD_TICKS, firmware_constants
from chefbot.config_text import plain_sections, yaml_text
from chefbot.design.checks.geometry_checks import check
from chefbot.design.checks.sensor_occlusion import NOISE_RESERVE, hidden_sectors
from chefbot.design.errors import DesignError
from chefbot.design.generation.parameters import NUMBERS, draw_numbers
from chefbot.design.generation.sensor_mounts import sensors_of
from chefbot.design.sizing.component_selection import Parts, Verdict, settled, verdicts
from chefbot.design.sizing.dependent_dimensions import NOTCH_EXTRA_LENGTH, with_radius
from chefbot.robot.catalogue import Catalogue
from chefbot.robot.chassis import Notch
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import build_robot
from chefbot.robot.sensors import Lidar
from chefbot.robot.spec import Robot

MAX_TICK = 5e-4
"""Distance that a wheel may roll per encoder tick, m: ten ticks in the 50 ms of one speed measurement at 0.1 m/s."""
MAX_HIDDEN = 0.15
"""Share of the lidar's field of view that the robot's tubes may hide."""
ATTEMPTS = 8
"""Times that a robot is drawn again, less demanding each time, until everything fits."""
CENTRE_HOLE = 0.03
"""Diameter of the hole for the wiring, m: every battery of the catalogue stands over it."""
WHEEL_AIR = 0.0075
"""Distance between a wheel's inner face and its notch, m, as on the Chefbot."""
EASED = ("payload", "speed", "turn", "acceleration", "slope", "run_time")
"""Numbers that come closer to the low end of their range with each attempt."""


class GeneratedRobot(NamedTuple):
    """A robot, and the sections of its file; motor, driver and battery are names of the catalogue."""

    robot: Robot
    sections: dict[str, Any]

    def text(self, comment: str) -> str:
        """Return the robot file. comment: text of its first lines."""
        return yaml_text(self.sections, comment)


def generate_robot(
    seed: int, given: Mapping[str, float], template: Robot, catalogue: Catalogue
) -> GeneratedRobot:
    """Return the robot of a seed; the same arguments give the same robot, and the same file.

    given: numbers that are not drawn, see `parameters.NUMBERS`. template: what no number describes, such as plate
    thickness and computer; motor, driver and battery are the catalogue's best. `chefbot robot check` finds no error
    in the robot. Raises DesignError for an unknown number, one outside its range, and if no set of parts fits.
    """
    numbers = draw_numbers(given, np.random.default_rng(seed))
    for attempt in range(ATTEMPTS):
        eased = {**numbers, **_eased(numbers, attempt), **given}
        verdict = _with_parts(_drawn(template, seed, eased), catalogue)
        if verdict is not None and (found := _finished(verdict, catalogue)) is not None:
            return found
    raise DesignError(
        f"no robot with seed {seed} fits: no motors, driver and battery of the catalogue carry what is given;"
        " ask for less payload, speed or run time"
    )


def _eased(numbers: Mapping[str, float], attempt: int) -> dict[str, float]:
    share = 1.0 - attempt / (ATTEMPTS - 1)
    return {name: round(NUMBERS[name].low + share * (numbers[name] - NUMBERS[name].low), 3) for name in EASED}


def _drawn(template: Robot, seed: int, n: Mapping[str, float]) -> Robot:
    """Return the robot with the drawn numbers and the dimensions that depend on them, with the template's parts."""
    robot = _replace(template, "wheels", diameter=n["wheel_diameter"], width=n["wheel_width"])
    robot = _replace(with_radius(robot, n["radius"]), "tubes", length=n["bay"])
    robot = _replace(robot, "wheels", separation=_separation(robot))
    robot = _replace(robot, "plates", notch=_notch(robot), centre_hole=CENTRE_HOLE)
    robot = _replace(robot, "casters", offset=round(robot.casters.offset, 4))
    robot = _replace(robot, "poles", reach=round(robot.poles.reach, 4))
    robot = _replace(robot, "body", payload=n["payload"])
    robot = _replace(robot, "power", run_time=round(3600.0 * n["run_time"]))
    robot = _replace(
        robot, "drive", max_speed=n["speed"], max_turn=n["turn"], max_acceleration=n["acceleration"],
        max_slope=round(math.radians(n["slope"]), 4),
    )  # fmt: skip
    return msgspec.structs.replace(robot, name=f"robot_{seed}", sensors=sensors_of(robot, n))


def _replace(robot: Robot, section: str, **values: Any) -> Robot:
    part = msgspec.structs.replace(getattr(robot, section), **values)
    return msgspec.structs.replace(robot, **{section: part})


def _separation(robot: Robot) -> float:
    """Return the wheel separation with which the outer corners of the wheels lie on the circle of the plates, m."""
    reach = robot.body.plate.half_width_at(robot.wheel_radius)
    return math.floor(1000.0 * (2.0 * reach - robot.wheels.width)) / 1000.0


def _notch(robot: Robot) -> Notch:
    """Return the notches round the wheels."""
    depth = layout.wheel_recess(robot) + WHEEL_AIR
    return Notch(length=round(robot.wheels.diameter + NOTCH_EXTRA_LENGTH, 4), depth=round(depth, 4))


def _with_parts(robot: Robot, catalogue: Catalogue) -> Verdict | None:
    """Return the robot with the best motor, driver and battery whose encoder fits; None if none passes."""
    return settled(one for one in verdicts(robot, catalogue) if _encoder_fits(one.robot))


def _encoder_fits(robot: Robot) -> bool:
    """Whether the encoder is fine enough to measure a slow speed, and not too fine for the firmware's integers."""
    return robot.metres_per_tick <= MAX_TICK and robot.motor.no_load_tick_rate <= MAX_NO_LOAD_TICKS


def _finished(verdict: Verdict, catalogue: Catalogue) -> GeneratedRobot | None:
    """Return the robot as read from its file; None with an error of `chefbot robot check`, or without
    constants for the firmware."""
    robot = verdict.robot
    lidar = robot.sensors.lidar
    if lidar is not None:
        sectors = hidden_sectors(robot, lidar)
        if sectors.angle > MAX_HIDDEN * lidar.field_of_view:
            return None
        robot = _seeing(robot, lidar, sectors.farthest)
    robot = _replace(robot, "body", mass_budget=math.ceil(10.0 * unloaded_mass(robot)) / 10.0)
    sections = _sections(robot, verdict.parts)
    try:
        read = build_robot(sections, f"robot {robot.name}")
        firmware_constants(read)
    except RobotFileError:
        return None
    errors = [finding for finding in check(read, catalogue) if finding.severity == "error"]
    return None if errors else GeneratedRobot(read, sections)


def _seeing(robot: Robot, lidar: Lidar, farthest: float) -> Robot:
    """Return the robot whose lidar ignores what it sees of the robot itself."""
    minimum = math.ceil(1000.0 * (farthest + NOISE_RESERVE * lidar.noise)) / 1000.0
    lidar = msgspec.structs.replace(lidar, range_min=max(lidar.range_min, minimum))
    return _replace(robot, "sensors", lidar=lidar)


def _sections(robot: Robot, parts: Parts) -> dict[str, Any]:
    return {**plain_sections(robot), **parts._asdict()}
