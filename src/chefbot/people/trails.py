"""Places that people have left: the marks of sensors there were the person."""

from __future__ import annotations

import math

import numpy as np

from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.people.observation import Floats

Point = tuple[float, float]
BODY_RADIUS = 0.25
"""Radius of a place, m: a body takes it, so no furniture was within it while a person was there."""
SPACING = 0.1
"""Distance of places along a trail, m."""
LEFT_DISTANCE = 0.55
"""Distance from all people beyond which a place has been left, m: two bodies, and what delayed images show."""
MAX_PLACES = 200
"""Places of a person that are remembered, the newest."""
MAX_STEP = 0.5
"""Distance between two sightings beyond which it may not be the same person, m: the tracker was restarted, or
somebody else came out from where the person was hidden."""
MAX_DEVIATION = 0.15
"""Standard deviation of the position up to which it is known where a person is, m."""


class PeopleTrails:
    """Where each person was seen, until it is seen elsewhere.

    Places of a person who was lost stay marked: the person may still be there.
    """

    def __init__(self) -> None:
        self._trails: dict[int, list[Point]] = {}

    def left(self, message: TrackedPeople) -> Floats:
        """Return the places (n, 2), m, in the frame of the message, that people have left since the last message."""
        known = {person.id: person for person in message.people}
        self._trails = {number: places for number, places in self._trails.items() if number in known}
        now = [_position(person) for person in message.people]
        gone: list[Point] = []
        for person in message.people:
            if person.visible and _deviation(person) <= MAX_DEVIATION:
                gone += self._advance(person, now)
        return np.array(gone, np.float64).reshape(-1, 2)

    def _advance(self, person: TrackedPerson, now: list[Point]) -> list[Point]:
        """Add a person's position to its trail; remove and return the positions that it has left."""
        here, places = _position(person), self._trails.setdefault(person.id, [])
        if places and math.dist(places[-1], here) > MAX_STEP:
            places.clear()
        if not places or math.dist(places[-1], here) >= SPACING:
            places.append(here)
            del places[:-MAX_PLACES]
        gone = [place for place in places if all(math.dist(place, other) > LEFT_DISTANCE for other in now)]
        places[:] = [place for place in places if place not in gone]
        return gone


def _position(person: TrackedPerson) -> Point:
    return person.position.x, person.position.y


def _deviation(person: TrackedPerson) -> float:
    return math.sqrt(max(float(person.covariance[0]), float(person.covariance[5])))
