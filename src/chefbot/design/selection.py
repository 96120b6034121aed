"""Motor, driver and battery of the catalogue for a robot: every set is judged, the lightest that passes is chosen."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import msgspec

from chefbot.design.checks import Check, boards, judge
from chefbot.design.forces import DRIVEN_WHEELS
from chefbot.design.power import mean_power
from chefbot.design.stability import Load, loaded
from chefbot.robot.catalogue import Catalogue
from chefbot.robot.spec import Robot

NEARLY_LIGHTEST = 1.1
CRITERION = (
    "Of all sets that pass every check, and whose two motors, driver boards and battery weigh at most a tenth more "
    "than those of the lightest, the one is chosen that draws the least power."
)


class Parts(NamedTuple):
    """A set, by its names in the catalogue."""

    motor: str
    driver: str
    battery: str


class Verdict(NamedTuple):
    """A robot with a set of parts, and how it does."""

    parts: Parts
    robot: Robot
    load: Load
    checks: list[Check]

    @property
    def passed(self) -> bool:
        """Whether every check passes."""
        return all(check.passed for check in self.checks)

    @property
    def lack(self) -> float:
        """Sum over the checks of the shares that are missing."""
        return sum(check.lack for check in self.checks)

    @property
    def failures(self) -> list[Check]:
        """The checks that do not pass, the worst first."""
        return sorted((check for check in self.checks if not check.passed), key=lambda check: -check.lack)

    @property
    def mass(self) -> float:
        """Of both motors, the driver boards and the battery, kg."""
        robot = self.robot
        return DRIVEN_WHEELS * robot.motor.mass + boards(robot) * robot.driver.mass + robot.battery.mass

    @property
    def power(self) -> float:
        """From the battery while driving, W."""
        return mean_power(self.robot, self.load.mass).value


def verdicts(robot: Robot, catalogue: Catalogue) -> list[Verdict]:
    """Every set of the catalogue in this robot. Mass and centre follow the parts."""
    return [
        _verdict(robot, catalogue, Parts(*names))
        for names in product(catalogue.motors, catalogue.drivers, catalogue.batteries)
    ]


def _verdict(robot: Robot, catalogue: Catalogue, parts: Parts) -> Verdict:
    candidate = msgspec.structs.replace(
        robot,
        motor=catalogue.motors[parts.motor],
        driver=catalogue.drivers[parts.driver],
        battery=catalogue.batteries[parts.battery],
    )
    load = loaded(candidate)
    return Verdict(parts, candidate, load, judge(candidate, load))


def choose(candidates: Iterable[Verdict]) -> Verdict | None:
    """By CRITERION; None where no set passes."""
    passing = [verdict for verdict in candidates if verdict.passed]
    limit = NEARLY_LIGHTEST * min((verdict.mass for verdict in passing), default=0.0)
    light = [verdict for verdict in passing if verdict.mass <= limit]
    return min(light, key=lambda verdict: (verdict.power, verdict.mass), default=None)


def nearest(candidates: Iterable[Verdict]) -> Verdict:
    """The set that lacks the least."""
    return min(candidates, key=lambda verdict: (verdict.lack, verdict.mass))


def best_with(candidates: Iterable[Verdict], part: str, name: str) -> Verdict:
    """The best set that holds the component `name` as its `part` ('motor', 'driver' or 'battery').

    Where none passes: the set in whose company the others lack the least, so that what fails is the component.
    """
    holding = [verdict for verdict in candidates if getattr(verdict.parts, part) == name]
    return choose(holding) or min(holding, key=lambda verdict: _others_first(verdict, part))


def _others_first(verdict: Verdict, part: str) -> tuple[float, float]:
    own = sum(check.lack for check in verdict.checks if check.part == part)
    return verdict.lack - own, own
