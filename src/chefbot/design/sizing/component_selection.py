"""Selection of motor, driver and battery: every set of the catalogue is checked, a light one is chosen."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import msgspec

from chefbot.design.sizing.dependent_dimensions import with_motor
from chefbot.design.sizing.energy_budget import mean_power
from chefbot.design.sizing.forces import DRIVEN_WHEELS
from chefbot.design.sizing.requirements import Check, boards, judge
from chefbot.design.sizing.stability import Load, loaded
from chefbot.robot.catalogue import Catalogue
from chefbot.robot.geometry import layout
from chefbot.robot.spec import Robot

LIGHTEST_FACTOR = 1.1
CRITERION = (
    "Of all sets that pass every check and weigh (two motors, driver boards, battery) at most 10 % more than the "
    "lightest one, the set with the lowest power is selected."
)


class Parts(NamedTuple):
    """A set of parts, by their names in the catalogue."""

    motor: str
    driver: str
    battery: str


class Verdict(NamedTuple):
    """A robot with a set of parts, and its checks."""

    parts: Parts
    robot: Robot
    load: Load
    checks: list[Check]

    @property
    def passed(self) -> bool:
        """Return whether every check passes."""
        return all(check.passed for check in self.checks)

    @property
    def lack(self) -> float:
        """Return the sum of the shortfalls of all checks, as shares."""
        return sum(check.lack for check in self.checks)

    @property
    def failures(self) -> list[Check]:
        """Return the failed checks, the worst first."""
        return sorted((check for check in self.checks if not check.passed), key=lambda check: -check.lack)

    @property
    def mass(self) -> float:
        """Return the mass of both motors, the driver boards and the battery, kg."""
        robot = self.robot
        return DRIVEN_WHEELS * robot.motor.mass + boards(robot) * robot.driver.mass + robot.battery.mass

    @property
    def power(self) -> float:
        """Return the battery's mean power while driving, W."""
        return mean_power(self.robot, self.load.mass).value


def verdicts(robot: Robot, catalogue: Catalogue) -> list[Verdict]:
    """Return the verdict on every set of the catalogue in this robot; mass and centre follow the parts.

    An obsolete driver is in a set only if the robot has it.

    The solids are weighed once for each motor; driver and battery are exchanged as boxes by calculation.
    `settled` weighs the solids of the choice.
    """
    drivers = _drivers_to_judge(robot, catalogue)
    sets = []
    for motor in catalogue.motors:
        driven = with_motor(robot, catalogue.motors[motor])
        load = loaded(driven)
        for driver, battery in product(drivers, catalogue.batteries):
            candidate = msgspec.structs.replace(
                driven, driver=catalogue.drivers[driver], battery=catalogue.batteries[battery]
            )
            exchanged = _exchanged(load, driven, candidate)
            checks = judge(candidate, exchanged)
            sets.append(Verdict(Parts(motor, driver, battery), candidate, exchanged, checks))
    return sets


def _drivers_to_judge(robot: Robot, catalogue: Catalogue) -> list[str]:
    return [
        name for name, driver in catalogue.drivers.items() if not driver.obsolete or driver == robot.driver
    ]


def _exchanged(load: Load, before: Robot, after: Robot) -> Load:
    """The load with the boxes of driver and battery of `after` instead of those of `before`."""
    terms = [(load.mass, (load.x, load.y, load.z))]
    for robot, sign in ((before, -1.0), (after, 1.0)):
        for box, place in ((robot.driver, robot.places.driver), (robot.battery, robot.places.battery)):
            height = layout.plate_top(robot, place.plate) + box.size.z / 2.0
            terms.append((sign * box.mass, (place.x, place.y, height)))
    mass = sum(weight for weight, _ in terms)
    return Load(mass, *(sum(weight * at[axis] for weight, at in terms) / mass for axis in range(3)))


def settled(candidates: Iterable[Verdict]) -> Verdict | None:
    """Return the choice, checked again with its solids weighed; the next one if it then fails."""
    left = list(candidates)
    while (choice := choose(left)) is not None:
        load = loaded(choice.robot)
        exact = choice._replace(load=load, checks=judge(choice.robot, load))
        if exact.passed:
            return exact
        left = [verdict for verdict in left if verdict is not choice]
    return None


def choose(candidates: Iterable[Verdict]) -> Verdict | None:
    """Return the best set by CRITERION; None if no set passes."""
    passing = [verdict for verdict in candidates if verdict.passed]
    limit = LIGHTEST_FACTOR * min((verdict.mass for verdict in passing), default=0.0)
    light = [verdict for verdict in passing if verdict.mass <= limit]
    return min(light, key=lambda verdict: (verdict.power, verdict.mass), default=None)


def nearest(candidates: Iterable[Verdict]) -> Verdict:
    """Return the set with the smallest shortfall."""
    return min(candidates, key=lambda verdict: (verdict.lack, verdict.mass))


def best_with(candidates: Iterable[Verdict], part: str, name: str) -> Verdict:
    """Return the best set that contains the component `name` as its `part` ('motor', 'driver' or 'battery').

    If none passes: the set whose other parts have the smallest shortfall, so that the component is what
    fails.
    """
    holding = [verdict for verdict in candidates if getattr(verdict.parts, part) == name]
    return choose(holding) or min(holding, key=lambda verdict: _others_first(verdict, part))


def _others_first(verdict: Verdict, part: str) -> tuple[float, float]:
    own = sum(check.lack for check in verdict.checks if check.part == part)
    return verdict.lack - own, own
