"""Measures a robot at a blocked door: when it requests to pass, when it is through, and where it waits."""

from __future__ import annotations

import math

from chefbot.buildings.world_file import Door
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.nav_msgs import Odometry
from chefbot.proving.simulated_run import SimulatedRun
from chefbot.runtime.loop import Publication
from chefbot.sim.world.doors import closed_middle

SPEECH = "robotsound"
"""Topic of the robot's speech."""
IN_DOOR_DISTANCE = 0.9
"""Distance of a person to the middle of a door up to which it is not free, m."""
OPEN_SHARE = 0.95
"""Opening from which a door is free, of 1."""
BEHIND_DOOR_DISTANCE = 0.5
"""Distance behind a door at which the robot is through, m."""
STANDSTILL_SPEED, STANDSTILL_TURN_RATE = 0.05, 0.1
"""Speeds below which the robot stands, m/s and rad/s."""
HELD_UP_TIME = 1.0
"""Time from which a robot that stands waits, and before a door that is not free is held up, s."""
NEAR_DOOR_DISTANCE = 6.0
"""Distance to the door within which a robot that stands is held up by it, m."""
PERSON_AHEAD_DISTANCE = 1.2
"""Distance within which a person in front of the robot holds it up, m."""
HALF_WALL = 0.08
"""Half the thickness of the wall of a doorway, m."""


class DoorwayObserver:
    """Observes the passage of one door; blocks, released: whether the event has begun, and whether it is over.

    side: sign of x of the goal's side, in the frame of the door's middle.
    """

    def __init__(self, run: SimulatedRun, door: Door, side: float) -> None:
        self._run, self.door = run, door
        self._middle = closed_middle(door)
        self._side = side
        self._doorways = [(closed_middle(one), one.width) for one in run.world.doors]
        self.blocks = self.released = False
        self.distance = math.inf
        """Distance of the robot to the middle of the door, m."""
        self.held_up_at = math.inf
        """Time from which the robot stands because of the door, s."""
        self._requested_at = math.inf
        self._ended_at = math.inf
        self._stands_since: float | None = None
        self._free = self._waited = self._in_doorway = 0.0
        self._through = self._active = False
        self._last: float | None = None

    def people_within(self, distance: float) -> int:
        """Return how many people are within a distance of the middle of the door, m."""
        people = self._run.safety.simulation.people if self._run.safety.simulation else []
        return sum(self._middle.distance(one) <= distance for one in people)

    def __call__(self, publication: Publication) -> None:
        """Measure with each ground truth; note requests to pass and the end of the goal."""
        message = publication.message
        if publication.topic == SPEECH:
            self._requested_at = min(self._requested_at, self._run.time)
        elif isinstance(message, NavigationStatus):
            if self._active and message.state == "idle":
                self._ended_at = min(self._ended_at, self._run.time)
            self._active = message.state != "idle"
        elif publication.topic == "ground_truth" and isinstance(message, Odometry):
            self._measure(message)

    def _measure(self, truth: Odometry) -> None:
        now, pose, twist = self._run.time, truth.pose.pose.se2, truth.twist.twist
        seconds, self._last = now - (self._last if self._last is not None else now), now
        self.distance = self._middle.distance(pose)
        stands = abs(twist.linear.x) < STANDSTILL_SPEED and abs(twist.angular.z) < STANDSTILL_TURN_RATE
        if not (stands and self._active):
            self._stands_since = None
        elif self._stands_since is None:
            self._stands_since = now
        x, y, _ = self._middle.between(pose)
        self._through = self._through or (
            BEHIND_DOOR_DISTANCE < self._side * x < 2.0 * BEHIND_DOOR_DISTANCE and abs(y) < self.door.width
        )
        if not self._through:
            self._hold_up(now, pose)
            self._free += seconds if self.released and self._is_free() else 0.0
        # a shorter pause is part of the motion
        if self._stands_since is not None and now - self._stands_since >= HELD_UP_TIME:
            self._waited += seconds
            self._in_doorway += seconds if self._stands_in_doorway(pose) else 0.0

    def _hold_up(self, now: float, pose: SE2) -> None:
        since = self._stands_since
        if (
            since is None
            or now - since < HELD_UP_TIME
            or self.distance > NEAR_DOOR_DISTANCE
            or not self.blocks
        ):
            return
        if not self._is_free() or self._people_before(pose):
            self.held_up_at = min(self.held_up_at, since)

    def _people_before(self, pose: SE2) -> bool:
        """Return whether a person stands in front of the robot."""
        simulation = self._run.safety.simulation
        near = [pose.between(one) for one in (simulation.people if simulation else [])]
        return any(one.x > 0.0 and math.hypot(one.x, one.y) <= PERSON_AHEAD_DISTANCE for one in near)

    def _is_free(self) -> bool:
        simulation = self._run.safety.simulation
        opening = simulation.doors()[self.door.name] if simulation else 1.0
        return opening >= OPEN_SHARE and self.people_within(IN_DOOR_DISTANCE) == 0

    def _stands_in_doorway(self, pose: SE2) -> bool:
        radius = self._run.system.robot.circumscribed_radius
        for middle, width in self._doorways:
            x, y, _ = middle.between(pose)
            if abs(x) < HALF_WALL + radius and abs(y) < 0.5 * width:
                return True
        return False

    def figures(self, reached: bool, patience: float) -> dict[str, float]:
        """Return the figures of the passage; 0 for a delay that it did not have."""
        given_up = not reached and self._ended_at - min(self.held_up_at, self._ended_at) < patience
        figures = {"given_up": float(given_up)}
        figures["doorway_share"] = self._in_doorway / self._waited if self._waited else 0.0
        held_up = self.held_up_at < math.inf
        figures["request_delay"] = max(0.0, self._requested_at - self.held_up_at) if held_up else 0.0
        if self._through:
            figures["passage_delay"] = self._free
        return {name: value for name, value in figures.items() if math.isfinite(value)}
