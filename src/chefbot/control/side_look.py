"""Looks to the sides before a robot whose sensors see only ahead drives on among people.

People who come from the side stop beside the robot, outside the view and too near for a depth camera; the robot
would drive off into them. It looks to both sides before it drives off after standing or rotating, and to one side
when a person whom it saw coming near has left its view.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.control.people_cost import NearbyPeople
from chefbot.control.rotation import rotation_rate
from chefbot.control.seen_directions import SeenDirections
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.motion_limits import Limits

SIDE_BEARING = math.radians(80.0)
"""Bearing up to which it looks to each side: somebody farther back is not before the robot that drives off."""
DRIVEN_DISTANCE = 0.25
"""Distance from which the robot has driven on, m: it sees its sides while they are still before it."""
STANDING_TIME, TURNED_ANGLE = 2.0, math.radians(45.0)
"""Time for which the robot has not driven on, s, and angle by which it has turned since, rad: somebody may be at its
sides then."""
PEOPLE_MEMORY = 600.0
"""Time after the last person was seen for which people are about, s: out of view they may come from anywhere."""
MAX_AGE_BEFORE_START, MAX_AGE_BEFORE_PASSING = 3.0, 1.0
"""Ages, s, up to which a side counts as seen: before driving off, and beside somebody who walks."""
PERSON_DISTANCE = 0.8
"""Distance to a person's centre, less the standard deviation of the prediction, within which it looks for them, m."""
MAX_DEVIATION = 0.5
"""Standard deviation of a prediction that counts at most, m: else it would look for everybody who has passed."""
FRONT_BEARING = math.radians(110.0)
"""Bearing beyond which a person is behind the robot, rad."""
HIDDEN_TIME = 6.0
"""Time for which it waits at a direction without data, s: somebody leaves, furniture that returns nothing stays."""
MAX_TIME = 20.0
"""Maximum time of a look, s: people who walk around the robot hide one direction after the other."""
PAUSE, SHORT_PAUSE = 4.0, 2.0
"""Times after a look before the next one in about the same direction, and before one after a person, s."""
INNER_VIEW = 0.65
"""Fraction of the view in which a direction is surely seen, with the latency of the sensor while the robot turns."""
RETURN_TOLERANCE = 0.1
"""Error of the heading at which it has turned back, rad."""
STANDSTILL_SPEED = 0.02
"""Speed below which it stands and may turn, m/s."""


class SideView(NamedTuple):
    """A command of a robot that looks to its sides: its turn rate, rad/s, and whether it waits for what is hidden."""

    w: float
    hidden: bool = False


class _Look(NamedTuple):
    """A look that has begun.

    heading: to which the robot returns. low, high: directions to see, all rad in odom. since_ns: they count as seen
    since then. began_ns: when it began.
    """

    heading: float
    low: float
    high: float
    since_ns: int
    began_ns: int


class SideLook:
    """Decides when a robot looks to its sides, and commands the rotations. All poses are in odom, times in ns.

    half_view: half the angle of view of its sensor, rad. period: time between two steps, s.
    """

    def __init__(self, half_view: float, limits: Limits, period: float) -> None:
        self._half_view, self._limits, self._period = half_view, limits, period
        self.seen = SeenDirections()
        self._people_ns: int | None = None
        self._drove_ns, self._drove_to = -(10**18), IDENTITY
        self._pause_until_ns = 0
        self.reset()

    def note_people(self, now_ns: int) -> None:
        """Note that somebody is seen now."""
        self._people_ns = now_ns

    def reset(self) -> None:
        """Stop looking: something else drives the robot."""
        self._look: _Look | None = None
        self._hidden_time = 0.0

    def step(
        self, pose: SE2, wanted: float, speed: float, people: NearbyPeople, now_ns: int
    ) -> SideView | None:
        """Return the rotation to command in place of driving forward, or None: the robot may drive.

        wanted: forward speed that the controller wants, speed: the one at present, m/s. people: those around.
        """
        if pose.distance(self._drove_to) >= DRIVEN_DISTANCE:
            self._drove_ns, self._drove_to = now_ns, pose
        if self._look is None and wanted > 0.0:
            self._look = self._needed(pose, people, now_ns)
        if self._look is None:
            return None
        return self._continue(self._look, pose, speed, now_ns)

    def _needed(self, pose: SE2, people: NearbyPeople, now_ns: int) -> _Look | None:
        """Return the look that is needed before the robot drives forward, or None."""
        about = self._people_ns is not None and now_ns - self._people_ns <= PEOPLE_MEMORY * 1e9
        turned = abs(wrap(pose.yaw - self._drove_to.yaw))
        stood = now_ns - self._drove_ns >= STANDING_TIME * 1e9 or turned >= TURNED_ANGLE
        looks = []
        if about and stood:
            since_ns = now_ns - round(MAX_AGE_BEFORE_START * 1e9)
            looks.append(_Look(pose.yaw, pose.yaw - SIDE_BEARING, pose.yaw + SIDE_BEARING, since_ns, now_ns))
        side = self._side_of_unseen_person(pose, people, now_ns)
        if side and now_ns >= self._pause_until_ns:
            low, high = sorted((pose.yaw + side * self._half_view, pose.yaw + side * SIDE_BEARING))
            looks.append(_Look(pose.yaw, low, high, now_ns - round(MAX_AGE_BEFORE_PASSING * 1e9), now_ns))
        return next((look for look in looks if len(self._unseen(look))), None)

    def _side_of_unseen_person(self, pose: SE2, people: NearbyPeople, now_ns: int) -> float:
        """Return the side, 1 left and -1 right, on which somebody may be near and out of view; 0 for nobody."""
        since_ns = now_ns - round(MAX_AGE_BEFORE_PASSING * 1e9)
        for x, y, _, _, variance, *_ in people.states.tolist():
            distance = math.hypot(x - pose.x, y - pose.y)
            deviation = min(math.sqrt(max(variance, 0.0)), MAX_DEVIATION)
            bearing = wrap(math.atan2(y - pose.y, x - pose.x) - pose.yaw)
            if distance - deviation > PERSON_DISTANCE or abs(bearing) > FRONT_BEARING:
                continue
            # they may be farther to the side than predicted, beyond the edge of the view
            outward = bearing + math.copysign(math.atan2(deviation, distance), bearing)
            low, high = sorted((pose.yaw + bearing, pose.yaw + outward))
            if len(self.seen.not_seen_since(since_ns, low, high)):
                return math.copysign(1.0, bearing)
        return 0.0

    def _unseen(self, look: _Look) -> NDArray[np.float64]:
        return self.seen.not_seen_since(look.since_ns, look.low, look.high)

    def _continue(self, look: _Look, pose: SE2, speed: float, now_ns: int) -> SideView | None:
        """Return the next command of a look; None once all was seen and the robot is back at its heading."""
        if speed > STANDSTILL_SPEED:
            return SideView(0.0)
        gives_up = self._hidden_time >= HIDDEN_TIME or now_ns - look.began_ns >= MAX_TIME * 1e9
        offsets = [] if gives_up else [wrap(one - pose.yaw) for one in self._unseen(look).tolist()]
        if not offsets:
            return self._return(look, pose, now_ns)
        nearest, in_view = min(offsets, key=abs), INNER_VIEW * self._half_view
        if abs(nearest) <= in_view:
            self._hidden_time += self._period
            return SideView(0.0, hidden=True)
        # turn on until the last direction on this side is in view
        farthest = max(offset * math.copysign(1.0, nearest) for offset in offsets)
        return SideView(rotation_rate(math.copysign(farthest - in_view, nearest), self._limits))

    def _return(self, look: _Look, pose: SE2, now_ns: int) -> SideView | None:
        """Return the rotation back to the heading of a look; None once the robot is there."""
        angle = wrap(look.heading - pose.yaw)
        if abs(angle) > RETURN_TOLERANCE:
            return SideView(rotation_rate(angle, self._limits))
        self.reset()
        self._pause_until_ns = now_ns + round(SHORT_PAUSE * 1e9)
        self._drove_ns, self._drove_to = now_ns + round((PAUSE - STANDING_TIME) * 1e9), pose
        return None
