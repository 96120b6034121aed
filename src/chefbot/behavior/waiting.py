"""Whether a robot whose path is blocked waits, takes another path or gives up, by comparing expected times."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from chefbot.behavior.recovery import WaitingParams
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import FindBlockage_Result, Quantity
from chefbot.msgs.chefbot_msgs.people import TrackedPeople

MOVED_DISTANCE = 0.4
"""Distance from which somebody who stands counts as having gone elsewhere, m."""
STANDING_TIME = 1.0
"""Time from which somebody stands and does not only turn, s."""
SAME_PLACE_DISTANCE = 1.5
"""Distance up to which two blockages are the same one, m: people shift from foot to foot, and the robot sees more."""
BLOCKAGE_MEMORY = 60.0
"""Time after which a blockage at the same place is another one, s."""
OBSTACLE_WAIT = 10.0
"""First time to wait for what is not known to be a person before a recovery behavior is tried, s; it doubles."""
WALKING_WAIT = 2.0
"""Time after which somebody who walks is expected to be out of the way, s."""


def expected_remaining_wait(stood: float, typical: float) -> float:
    """Return the expected time (s) that somebody stays who has stood for `stood` seconds.

    The mean residual life of a Lomax distribution of shape 2 and scale `typical` (Lomax 1954): how long people stand
    differs by orders of magnitude, so that the longer somebody has stood, the longer the rest is.
    """
    return typical + stood


class StandingTimes:
    """Since when each tracked person stands at its place."""

    def __init__(self) -> None:
        self._since: dict[int, tuple[float, float, float]] = {}

    def process(self, message: TrackedPeople) -> None:
        """Process the people of a message, in a continuous frame such as odom."""
        now, before = message.header.stamp.ns / 1e9, self._since
        self._since = {}
        for one in message.people:
            since, x, y = before.get(one.id, (now, one.position.x, one.position.y))
            if not one.standing or math.hypot(one.position.x - x, one.position.y - y) > MOVED_DISTANCE:
                since, x, y = now, one.position.x, one.position.y
            self._since[one.id] = since, x, y

    def stood(self, person: int, now: float) -> float:
        """Return for how long a person has stood, s; 0 for one who walks or is not known."""
        stood = now - self._since[person][0] if person in self._since else 0.0
        return stood if stood >= STANDING_TIME else 0.0

    @property
    def anybody(self) -> bool:
        """Whether at least one person is tracked."""
        return bool(self._since)


def person_ahead(people: TrackedPeople, robot: SE2, reach: float) -> int | None:
    """Return the number of the nearest person in front of the robot, within `reach` metres, or None.

    robot: its pose in the frame of the people.
    """
    if not people.people:
        return None
    places = robot.inverse().apply(np.array([[one.position.x, one.position.y] for one in people.people]))
    distances = np.hypot(places[:, 0], places[:, 1])
    ahead = (distances <= reach) & (places[:, 0] > 0.0)
    if not ahead.any():
        return None
    return people.people[int(np.argmin(np.where(ahead, distances, np.inf)))].id


class WaitDecision(NamedTuple):
    """Whether to wait, or that the goal is to be given up; a sentence with the numbers, and the numbers."""

    waits: bool
    gives_up: bool = False
    sentence: str = ""
    numbers: tuple[Quantity, ...] = ()


PROCEED = WaitDecision(waits=False)


class WaitingPolicy:
    """Decides about each blockage in turn; it remembers how long the robot has waited at each place."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._place = (math.inf, math.inf)
        self._began = self._seen = -math.inf
        self._attempts = 0
        self._attempt_began: float | None = None

    def begin(self) -> None:
        """Begin a period of waiting, after which a recovery behavior may follow."""
        self._attempt_began = None

    def waited(self, now: float) -> float:
        """Return the time since the present blockage began, s."""
        return max(0.0, now - self._began)

    def decide(
        self, found: FindBlockage_Result, standing: StandingTimes, now: float, params: WaitingParams
    ) -> WaitDecision:
        """Return whether to wait for the blockage that was found at a time (s), or to give up."""
        if not found.blocked:
            return PROCEED
        self._note_place(found, now)
        people = tuple(int(one) for one in found.people)
        stood = max((standing.stood(one, now) for one in people), default=0.0)
        # a place that has been blocked for a while stays so, even if the tracker finds somebody new there
        blocked = max(stood, self.waited(now))
        expected = expected_remaining_wait(blocked, params.typical_stay) if stood > 0.0 else WALKING_WAIT
        detour = found.extra_length / self._speed if found.alternative_path else math.inf
        numbers = (
            Quantity("waited", self.waited(now), "s"),
            Quantity("distance", found.distance, "m"),
            *((Quantity("stood", stood, "s"), Quantity("expected wait", expected, "s")) if people else ()),
            *((Quantity("detour", detour, "s"),) if math.isfinite(detour) else ()),
        )
        if math.isfinite(detour):
            return self._compare(people, stood, expected, detour, numbers)
        if self.waited(now) >= params.patience:
            text = f"{_who(people, stood)} Waited {self.waited(now):.0f} s, and there is no other path."
            return WaitDecision(waits=False, gives_up=True, sentence=text, numbers=numbers)
        if people:
            text = f"{_who(people, stood)} Waiting, for about {expected:.0f} s; there is no other path."
            return WaitDecision(waits=True, sentence=text, numbers=numbers)
        return self._wait_for_obstacle(now, numbers)

    def _compare(
        self,
        people: tuple[int, ...],
        stood: float,
        expected: float,
        detour: float,
        numbers: tuple[Quantity, ...],
    ) -> WaitDecision:
        """Compare the times of waiting and of the other path; the robot does not wait for people who walk."""
        waits = bool(people) and stood > 0.0 and expected < detour
        chosen = "waiting" if waits else "taking the other path"
        text = (
            f"{_who(people, stood)} Waiting takes about {expected:.0f} s, the other path {detour:.0f} s longer: "
            f"{chosen}."
        )
        return WaitDecision(waits=waits, sentence=text, numbers=numbers)

    def _wait_for_obstacle(self, now: float, numbers: tuple[Quantity, ...]) -> WaitDecision:
        """Wait for what may be a door or an unrecognized person, twice as long each time."""
        if self._attempt_began is None:
            self._attempt_began = now
        if now - self._attempt_began >= OBSTACLE_WAIT * 2.0**self._attempts:
            self._attempts, self._attempt_began = self._attempts + 1, None
            return WaitDecision(waits=False, gives_up=True, sentence=_who((), 0.0), numbers=numbers)
        text = f"{_who((), 0.0)} Waiting; there is no other path."
        return WaitDecision(waits=True, sentence=text, numbers=numbers)

    def _note_place(self, found: FindBlockage_Result, now: float) -> None:
        """Restart the time of waiting at a blockage elsewhere, or after a free path."""
        place = found.point.x, found.point.y
        if math.dist(place, self._place) > SAME_PLACE_DISTANCE or now - self._seen > BLOCKAGE_MEMORY:
            self._began = now
        if now - self._seen > BLOCKAGE_MEMORY:
            self._attempts = 0
        self._place, self._seen = place, now


def _who(people: tuple[int, ...], stood: float) -> str:
    """Return who is in the way and for how long (s), as a sentence."""
    if not people:
        return "Something that is not on the map is in the way."
    several = len(people) > 1
    names = (
        f"People {', '.join(str(one) for one in people[:-1])} and {people[-1]}"
        if several
        else f"Person {people[0]}"
    )
    if stood > 0.0:
        return f"{names} {'have' if several else 'has'} stood in the way for {stood:.0f} s."
    return f"{names} {'are' if several else 'is'} in the way."
