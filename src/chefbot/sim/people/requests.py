"""Requests to the people of a world: to stand in a doorway, to block the robot, and to go on."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.sim.people.person import Doing, SimulatedPerson
from chefbot.sim.world.doors import MovingDoor, closed_middle
from chefbot.sim.world.furniture import PERSON_RADIUS

if TYPE_CHECKING:
    from chefbot.sim.people.people import SimulatedPeople

BLOCK_DISTANCE = 0.4
"""Metres that somebody who blocks the robot leaves to it."""
PLACES = ((0.4, 0.0), (-0.4, 0.0), (0.95, 0.3), (-0.95, -0.3), (0.95, -0.4), (-0.95, 0.4))
"""Where people stand in a doorway, the first comers first: along the passage through it and across it, m."""
AT_PLACE_DISTANCE = 0.12
"""Distance up to which somebody stands at a place, m."""
APPROACH_DISTANCE = 1.5
"""Distance to the middle of a doorway from which people go straight to their places, m."""
HELP = "'meet DOOR NUMBER', 'block' or 'leave'"


class PeopleRequests:
    """Interrupts what people do; those who are met in a doorway stay until "leave".

    destination: returns the number of a destination at a point, which people can walk to.
    """

    def __init__(
        self,
        scene: SimulatedPeople,
        doors: tuple[MovingDoor, ...],
        destination: Callable[[float, float], int],
    ) -> None:
        self._scene, self._destination = scene, destination
        self._doors = {moving.door.name: moving for moving in doors}
        self._destinations: dict[str, int] = {}
        self._met: list[SimulatedPerson] = []

    def process(self, text: str, persons: list[SimulatedPerson]) -> None:
        """Process 'meet DOOR NUMBER', 'block' or 'leave'. Raises UserError for anything else."""
        verb, *arguments = text.split() or [""]
        if verb == "meet" and len(arguments) == 2 and arguments[1].isdecimal():
            self._meet(arguments[0], int(arguments[1]), persons)
        elif verb == "block" and not arguments:
            near = sorted(persons, key=lambda one: self._scene.robot_distance(*one.at))
            self._met = self._met or near[:1]
            for person in self._met:
                person.interrupt(_block(person))
        elif verb == "leave" and not arguments:
            self._leave()
        else:
            raise UserError(f"people have no request {text[:60]!r}; use {HELP}")

    def _meet(self, name: str, number: int, persons: list[SimulatedPerson]) -> None:
        """Let the people who are nearest to a door stand in it."""
        if name not in self._doors:
            raise UserError(f"the world has no door {name[:60]!r}")
        if not 1 <= number <= min(len(persons), len(PLACES)):
            raise UserError(
                f"{number} people cannot meet: there are {len(persons)}, at most {len(PLACES)} fit"
            )
        middle = closed_middle(self._doors[name].door)
        if name not in self._destinations:
            self._destinations[name] = self._destination(middle.x, middle.y)
        self._leave()
        self._met = sorted(persons, key=lambda one: math.dist(one.at, middle[:2]))[:number]
        for person, place in zip(self._met, PLACES, strict=False):
            at = middle @ SE2(*place, 0.0)
            person.interrupt(_stand_at(person, self._destinations[name], at, middle))

    def _leave(self) -> None:
        for person in self._met:
            person.interrupt(())
        self._met = []


def _stand_at(person: SimulatedPerson, number: int, place: SE2, middle: SE2) -> Doing:
    """Go to a place in a doorway and stay, turned to its middle."""
    while True:
        if math.dist(person.at, place[:2]) <= AT_PLACE_DISTANCE:
            person.stand(middle[:2])
            yield
        elif math.dist(person.at, middle[:2]) < APPROACH_DISTANCE + AT_PLACE_DISTANCE:
            yield from person.come_to(place.x, place.y, AT_PLACE_DISTANCE, 3.0)
        else:
            yield from person.travel(number, within=APPROACH_DISTANCE)


def _block(person: SimulatedPerson) -> Doing:
    """Look for the robot, and stay in front of it."""
    while not person.scene.sees_robot(person.number):
        yield from person.walk_until_seen()
    yield from stay_before_robot(person, lambda: True)


def stay_before_robot(person: SimulatedPerson, goes_on: Callable[[], bool]) -> Doing:
    """Stay in front of the robot while `goes_on`."""
    scene = person.scene
    person.walkers.shy[person.number] = False
    while goes_on():
        x, y = scene.ahead_of_robot(scene.robot_radius + PERSON_RADIUS + BLOCK_DISTANCE)
        if math.dist(person.at, (x, y)) > AT_PLACE_DISTANCE and scene.floor.free(x, y) > PERSON_RADIUS:
            person.approach(x, y, scene.spec.fastest)
        else:
            person.stand(scene.robot_seen)
        yield
    person.walkers.shy[person.number] = scene.spec.avoid_robot
