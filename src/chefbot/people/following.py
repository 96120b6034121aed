"""Following a person: who it is, where the robot should be, and what it does when the person is lost."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.nav2_msgs import CONTROLLING, INITIAL_PERCEPTION, RETRY, STOPPING

GOAL_REJECTED, TF_ERROR, FAILED_TO_DETECT_OBJECT, FAILED_TO_CONTROL = 1, 901, 902, 903
"""Error codes of nav2_msgs/action/FollowObject."""
MAX_AHEAD_BEARING, MAX_AHEAD_DISTANCE = math.radians(60.0), 4.0
"""Bearing (rad) and distance (m) within which the nearest person ahead is chosen."""
NOBODY_AHEAD = "No person is ahead of the robot. Stand in front of it and try again."
DISTANCE_TOLERANCE, FACING_TOLERANCE = 0.25, 0.4
"""Errors of the distance (m) and of the heading towards the person (rad) at which the robot stands."""
DRIVE_DISTANCE_ERROR, TURN_HEADING_ERROR = 0.4, 0.7
"""The same errors at which it drives or turns again."""
ARRIVAL_DISTANCE = 0.6
"""Distance from the place where a person was last seen at which the robot looks round, m."""
GATE, WALKING_SPEED, MAX_GATE = 1.0, 1.5, 4.0
"""Distance from there within which somebody new is taken for the same person: at once (m), its growth (m/s), and
its maximum (m)."""


class FollowingParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of following a person, with Nav2's names as far as it has them."""

    desired_distance: Annotated[
        float, Meta(ge=0.5, le=5.0, description="distance to keep from the person, m")
    ] = 1.0
    detection_timeout: Annotated[
        float, Meta(ge=0.2, le=60.0, description="time out of sight after which a person counts as lost, s")
    ] = 2.0
    search_timeout: Annotated[
        float, Meta(ge=1.0, le=600.0, description="time to search for a lost person, s")
    ] = 30.0


class FollowStep(NamedTuple):
    """What to do now: Nav2's state, pose to drive to, whether to look around, and a sentence; an error ends it."""

    state: int
    sentence: str
    target: SE2 | None = None
    look_round: bool = False
    error_code: int = 0


class PersonFollower:
    """Decides where the robot should be to follow a person.

    number: the tracker's number of the person; 0 for the nearest one ahead. Poses, people and times (s) are those of
    the calls, all in one frame that does not jump. `retries` counts how often the person was lost.
    """

    def __init__(self, params: FollowingParams, number: int, now: float) -> None:
        self.params, self.number, self.retries = params, number, 0
        self._seen: TrackedPerson | None = None
        self._seen_at = now
        self._others: set[int] = set()
        self._lost = self._arrived = self._standing = False

    def step(self, robot: SE2, people: TrackedPeople | None, now: float) -> FollowStep:
        """Return what to do at time `now` with the newest people."""
        person = self._find(robot, people, now)
        if person is not None:
            self._seen, self._seen_at = person, now
            self._lost = self._arrived = False
            return self._keep_distance(robot, person)
        if self._seen is None:
            return self._not_found(now)
        hidden = now - self._seen_at
        if hidden < self.params.detection_timeout:
            return FollowStep(
                CONTROLLING, f"Following person {self.number}.", self._beside(robot, self._seen)
            )
        if not self._lost:
            self._lost, self.retries = True, self.retries + 1
        return self._search(robot, self._seen, hidden)

    def _find(self, robot: SE2, people: TrackedPeople | None, now: float) -> TrackedPerson | None:
        """Return the person if it is visible now, and remember who else is."""
        visible = {one.id: one for one in people.people if one.visible} if people is not None else {}
        if not self.number:
            self.number = _nearest_ahead(robot, list(visible.values()))
        elif self._lost and self.number not in visible:
            self.number = self._again(visible, now) or self.number
        person = visible.get(self.number)
        if person is not None:
            self._others = set(visible) - {self.number}
        return person

    def _again(self, visible: dict[int, TrackedPerson], now: float) -> int:
        """Return the number of a new person who is where the lost one can be by now; 0 for nobody."""
        assert self._seen is not None
        gate = min(GATE + WALKING_SPEED * (now - self._seen_at), MAX_GATE)
        last = self._seen.position
        distances = {
            number: math.hypot(one.position.x - last.x, one.position.y - last.y)
            for number, one in visible.items()
            if number not in self._others
        }
        nearest = min(distances, key=lambda number: (distances[number], number), default=0)
        return nearest if nearest and distances[nearest] <= gate else 0

    def _keep_distance(self, robot: SE2, person: TrackedPerson) -> FollowStep:
        away, bearing = _polar(robot, person)
        distance, angle = (
            (DRIVE_DISTANCE_ERROR, TURN_HEADING_ERROR)
            if self._standing
            else (DISTANCE_TOLERANCE, FACING_TOLERANCE)
        )
        near = away <= self.params.desired_distance + distance
        self._standing = near and abs(wrap(bearing - robot.yaw)) <= angle
        if self._standing:
            return FollowStep(STOPPING, f"Person {self.number} stands; waiting.")
        target = SE2(robot.x, robot.y, bearing) if near else self._beside(robot, person)
        return FollowStep(CONTROLLING, f"Following person {self.number}.", target)

    def _beside(self, robot: SE2, person: TrackedPerson) -> SE2:
        """Return the pose at the distance to be kept, on the line from the robot, facing the person."""
        away, bearing = _polar(robot, person)
        distance = max(away - self.params.desired_distance, 0.0)
        return SE2(robot.x + distance * math.cos(bearing), robot.y + distance * math.sin(bearing), bearing)

    def _not_found(self, now: float) -> FollowStep:
        if now - self._seen_at < self.params.detection_timeout:
            return FollowStep(INITIAL_PERCEPTION, "Looking for the person to follow.")
        text = f"Person {self.number} is not in sight." if self.number else NOBODY_AHEAD
        return FollowStep(INITIAL_PERCEPTION, text, error_code=FAILED_TO_DETECT_OBJECT)

    def _search(self, robot: SE2, person: TrackedPerson, hidden: float) -> FollowStep:
        """Drive to where the person was seen last, stop there and look around, and end after a time."""
        if hidden >= self.params.detection_timeout + self.params.search_timeout:
            text = f"Lost person {self.number} and did not find it in {hidden:.0f} s."
            return FollowStep(RETRY, text, error_code=FAILED_TO_DETECT_OBJECT)
        away, bearing = _polar(robot, person)
        self._arrived = self._arrived or away <= ARRIVAL_DISTANCE or hidden > self.params.search_timeout / 2.0
        if self._arrived:
            return FollowStep(RETRY, f"Lost person {self.number}; looking around.", look_round=True)
        heading = math.atan2(person.velocity.y, person.velocity.x) if not person.standing else bearing
        target = SE2(person.position.x, person.position.y, heading)
        return FollowStep(
            RETRY, f"Person {self.number} is out of sight; driving to its last position.", target
        )


def followed_person(tracked_frame: str) -> int | None:
    """Return the number in the name of a person's frame: `person_7` is 7, `person` or no name 0; None for others."""
    name, _, number = tracked_frame.partition("_")
    if name not in ("", "person") or (number and not number.isdecimal()):
        return None
    return int(number or 0)


def _polar(robot: SE2, person: TrackedPerson) -> tuple[float, float]:
    """Return the distance (m) of a person and its direction (rad) in the frame of the poses."""
    dx, dy = person.position.x - robot.x, person.position.y - robot.y
    return math.hypot(dx, dy), math.atan2(dy, dx)


def _nearest_ahead(robot: SE2, visible: list[TrackedPerson]) -> int:
    """Return the number of the nearest person ahead of the robot, 0 for nobody."""
    ahead = []
    for person in visible:
        away, bearing = _polar(robot, person)
        if away <= MAX_AHEAD_DISTANCE and abs(wrap(bearing - robot.yaw)) <= MAX_AHEAD_BEARING:
            ahead.append((away, person.id))
    return min(ahead)[1] if ahead else 0
