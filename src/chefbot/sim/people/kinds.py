"""The kinds of people that do more than walk between destinations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from numpy.random import Generator

from chefbot.sim.people.chairs import PULL_SPEED, TRAVEL, ChairTask
from chefbot.sim.people.person import Doing, SimulatedPerson
from chefbot.sim.people.requests import stay_before_robot
from chefbot.sim.people.spots import DoorwaySpot
from chefbot.sim.people.walkers import STAND
from chefbot.sim.world.furniture import PERSON_RADIUS

if TYPE_CHECKING:
    from chefbot.sim.people.people import SimulatedPeople

TALK_TIME = (10.0, 30.0)
"""Time for which two people talk in a doorway, s."""
TALK_DISTANCE = 0.4
"""Distance of each to the middle of the doorway, m."""
HIDE_TIME = 40.0
"""Time for which a person waits behind a corner for the robot, s."""
STEP_OUT_DISTANCE = 2.0
"""Distance of the robot to the corner at which a person steps out, m."""
SURPRISE_TIME = 2.0
"""Time for which a person stands in front of the robot after stepping out, s."""
FOLLOW_DISTANCE = 0.6
"""Metres that a follower leaves between itself and the robot."""
BLOCK_TIME, LEAVE_ALONE_TIME = (4.0, 10.0), (8.0, 20.0)
"""Times for which somebody blocks the robot, and then leaves it alone, s."""
DOOR_WAIT = 4.0
"""Time after which a person no longer waits for a door, s."""
DESTINATIONS_BETWEEN_TASKS = 2
"""Destinations that people visit between what their kind does."""


class Talker(SimulatedPerson):
    """Stands and talks in doorways; the first of each pair chooses where and when."""

    partner: Talker | None = None
    meeting: DoorwaySpot | None = None

    def steps(self) -> Doing:
        """Walk about, then talk, forever."""
        leads = self.partner is None or self.number < self.partner.number
        while True:
            if leads:
                yield from self._invite()
            if self.meeting is not None:
                yield from self._talk(self.meeting, 1.0 if leads else -1.0)
            yield from self.walk_about()

    def _invite(self) -> Doing:
        """Choose a doorway that can be reached, for both."""
        spots = self.scene.doorways
        if not spots:
            return
        place, number = spots[int(self.rng.integers(len(spots)))]
        if math.isfinite(self.scene.floor.path_length(number, *self.at)):
            self.meeting = place
            if self.partner is not None:
                self.partner.meeting = place
        yield

    def _talk(self, place: DoorwaySpot, side: float) -> Doing:
        """Go to the doorway and stand in it, turned to its middle."""
        number = next(n for spot, n in self.scene.doorways if spot == place)
        arrived = yield from self.travel(number, within=1.2)
        if arrived:
            x, y = place.x + side * TALK_DISTANCE * place.ux, place.y + side * TALK_DISTANCE * place.uy
            yield from self.come_to(x, y, 0.1, 4.0)
            self.stand((place.x, place.y))
            yield from self.pause(float(self.rng.uniform(*TALK_TIME)))
        self.meeting = None


class Companion(SimulatedPerson):
    """Walks in the group of `leader`."""

    def __init__(
        self, scene: SimulatedPeople, number: int, rng: Generator, pace: float, leader: SimulatedPerson
    ) -> None:
        super().__init__(scene, number, rng, pace)
        self.leader = leader

    def steps(self) -> Doing:
        """Go where the leader goes, and stay when it stays."""
        w, i = self.walkers, self.number
        while True:
            k = self.leader.number
            if w.mode[k] != STAND:
                w.mode[i], w.destination[i], w.aim[i] = w.mode[k], w.destination[k], w.aim[k]
                w.pace[i] = w.pace[k]
            elif math.dist(self.at, self.leader.at) < 1.0 or w.stuck[i] > 1.0:
                self.stand(self.leader.at)
            elif self.scene.floor.is_clear(*self.at, *self.leader.at, PERSON_RADIUS):
                self.approach(*self.leader.at)
            yield


class StepsOut(SimulatedPerson):
    """Waits behind a corner and steps out when the robot comes by."""

    def steps(self) -> Doing:
        """Hide and step out, forever; walk about where there is no corner."""
        while True:
            spots = self.scene.hiding_places
            if spots:
                near = sorted(spots, key=lambda one: self.scene.robot_distance(*one[0][:2]))[:4]
                place, number = near[int(self.rng.integers(len(near)))]
                arrived = yield from self.travel(number, within=0.2)
                if arrived:
                    yield from self._wait(place.out_x, place.out_y)
            yield from self.walk_about()

    def _wait(self, x: float, y: float) -> Doing:
        """Wait for the robot, then stand in its way for a moment."""
        end = self.scene.now + HIDE_TIME
        self.stand((x, y))
        while self.scene.now < end:
            yield
            if self.scene.robot_moves and self.scene.robot_distance(x, y) < STEP_OUT_DISTANCE:
                self.walkers.shy[self.number] = False
                yield from self.come_to(x, y, 0.15, 3.0, self.scene.spec.fastest)
                self.stand(self.scene.robot_seen)
                yield from self.pause(SURPRISE_TIME)
                self.walkers.shy[self.number] = self.scene.spec.avoid_robot
                return


class PullsChairs(SimulatedPerson):
    """Pulls chairs out and pushes them in."""

    def steps(self) -> Doing:
        """Move a chair, then walk about, forever."""
        while True:
            free = [chair for chair in self.scene.chairs if chair.user is None]
            if free:
                yield from self._use(free[int(self.rng.integers(len(free)))])
            for _ in range(DESTINATIONS_BETWEEN_TASKS):
                yield from self.walk_about()

    def _use(self, task: ChairTask) -> Doing:
        """Go behind the chair and pull it out, or push it in if it is out."""
        chair, task.user = task.chair, self.number
        try:
            out = chair.out > 0.5 * TRAVEL
            place = chair.behind(TRAVEL if out else 0.0)
            arrived = yield from self.travel(task.out_destination if out else task.in_destination, within=0.5)
            if arrived and (yield from self.come_to(*place, 0.08, 4.0)):
                self.stand((chair.pose.x, chair.pose.y))
                yield
                chair.target = 0.0 if out else TRAVEL
                # A puller walks backwards with the chair; a pusher follows it.
                yield from self.come_to(
                    *chair.behind(chair.target), 0.08, 2.0 * TRAVEL / PULL_SPEED, PULL_SPEED
                )
                self.stand((chair.pose.x, chair.pose.y))
                yield from self.pause(1.0)
                chair.target = chair.out
        finally:
            task.user = None


class UsesDoors(SimulatedPerson):
    """Opens a closed door or closes an open one from time to time."""

    def steps(self) -> Doing:
        """Use a door, then walk about, forever."""
        while True:
            if self.scene.door_sides:
                sides = self.scene.door_sides
                door, number = sides[int(self.rng.integers(len(sides)))]
                arrived = yield from self.travel(number, within=0.4)
                if arrived and not door.moving:
                    hinge = door.pose
                    self.stand((hinge.x, hinge.y))
                    door.target = 0.0 if door.open > 0.5 else 1.0
                    end = self.scene.now + DOOR_WAIT
                    while door.moving and self.scene.now < end:
                        yield
            for _ in range(DESTINATIONS_BETWEEN_TASKS):
                yield from self.walk_about()


class Follower(SimulatedPerson):
    """Follows the robot as long as it sees it, and walks about otherwise."""

    def steps(self) -> Doing:
        """Follow, or look for the robot, forever."""
        while True:
            yield from self.walk_until_seen()
            if self.scene.sees_robot(self.number):
                yield from self._follow()

    def _follow(self) -> Doing:
        """Keep behind the robot; go to where it was last seen before giving up."""
        self.walkers.shy[self.number] = False
        while self.scene.sees_robot(self.number):
            x, y = self.scene.robot_seen
            px, py = self.at
            distance = max(math.dist((x, y), (px, py)), 1e-6)
            keep = self.scene.robot_radius + PERSON_RADIUS + FOLLOW_DISTANCE
            if distance > keep + 0.1:
                share = (distance - keep) / distance
                self.approach(px + share * (x - px), py + share * (y - py), self.scene.spec.fastest)
            else:
                self.stand((x, y))
            yield
        yield from self.come_to(*self.scene.last_seen_by(self.number), 0.3, 5.0, self.scene.spec.fastest)
        self.walkers.shy[self.number] = self.scene.spec.avoid_robot


class Blocker(SimulatedPerson):
    """Stands in the robot's way for fun."""

    def steps(self) -> Doing:
        """Block the robot when it comes in sight, leave it alone for a while, forever."""
        while True:
            yield from self.walk_until_seen()
            if self.scene.sees_robot(self.number):
                yield from self._block()
            end = self.scene.now + float(self.rng.uniform(*LEAVE_ALONE_TIME))
            while self.scene.now < end:
                yield from self.walk_about()

    def _block(self) -> Doing:
        """Stay in front of the robot."""
        end = self.scene.now + float(self.rng.uniform(*BLOCK_TIME))
        yield from stay_before_robot(
            self, lambda: self.scene.now < end and self.scene.sees_robot(self.number)
        )
