"""What people do: each kind is a script that decides a few times a second.

A script is a generator; each `yield` waits for the next decision. Between decisions the kernel walks the person on.
"""

from __future__ import annotations

import math
from collections.abc import Generator as Script
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from chefbot.sim.people.walkers import APPROACH, STAND, WALK
from chefbot.sim.world.furniture import PERSON_RADIUS

if TYPE_CHECKING:
    from chefbot.sim.people.people import SimulatedPeople

REST = (1.0, 4.0)
"""Time for which people rest at a destination, s."""
PATIENCE = (1.0, 2.5)
"""Time after which a person who does not get on steps aside, s."""
STEP_ASIDE_DISTANCES = (0.6, 1.4)
"""Distances of the points to which people step aside, m."""
ARRIVAL_DISTANCE = 0.35
"""Distance to a destination at which people have arrived, m."""
MIN_ROUTE_LENGTH = 2.0
"""Least length of the path to a destination, m, if there is one so far away."""
ROUTE_SHARE = 0.7
"""Share of the destinations that lie on the routes of the world file."""

Doing = Script[None, None, None]
Trying = Script[None, None, bool]


class SimulatedPerson:
    """A person who walks between destinations; all randomness comes from `rng`."""

    def __init__(self, scene: SimulatedPeople, number: int, rng: np.random.Generator, pace: float) -> None:
        self.scene, self.number, self.rng, self.pace = scene, number, rng, pace
        self.walkers = scene.walkers
        self._patience = float(rng.uniform(*PATIENCE))
        self._script = self.steps()

    def decide(self) -> None:
        """Go on in the script."""
        next(self._script)

    def interrupt(self, request: Iterable[None]) -> None:
        """Execute a request in place of the script's present step, then restart the person's own script."""
        self._script.close()
        self.walkers.shy[self.number] = self.scene.spec.avoid_robot
        self.stand()
        self._script = self._after(request)

    def _after(self, request: Iterable[None]) -> Doing:
        yield from request
        yield from self.steps()

    def steps(self) -> Doing:
        """Walk from destination to destination, forever."""
        while True:
            yield from self.walk_about()

    def walk_about(self) -> Doing:
        """Walk to a destination and rest there; take some steps where none can be reached, as in a closed room."""
        number, pace = self._draw_destination()
        if number is None:
            yield from self.come_to(*self._roomiest_point(), 0.1, 3.0)
        else:
            yield from self.travel(number, pace)
        self.stand()
        yield from self.pause(float(self.rng.uniform(*REST)))

    def walk_until_seen(self) -> Doing:
        """Walk to a destination, but no further than to where the robot comes in sight."""
        for _ in self.walk_about():
            if self.scene.sees_robot(self.number):
                return
            yield

    # -- what scripts are made of

    @property
    def at(self) -> tuple[float, float]:
        """Position of the person in the map frame, m."""
        x, y = self.walkers.position[self.number].tolist()
        return x, y

    def pause(self, seconds: float) -> Doing:
        """Go on after some seconds."""
        end = self.scene.now + seconds
        yield
        while self.scene.now < end:
            yield

    def stand(self, towards: tuple[float, float] | None = None) -> None:
        """Stand, turned towards a point if there is one."""
        w, i = self.walkers, self.number
        w.mode[i] = STAND
        w.aim[i] = w.position[i] + w.heading[i] if towards is None else towards

    def approach(self, x: float, y: float, pace: float | None = None) -> None:
        """Walk straight to a point."""
        w, i = self.walkers, self.number
        w.mode[i], w.pace[i] = APPROACH, self.pace if pace is None else pace
        w.aim[i] = x, y

    def travel(self, destination: int, pace: float | None = None, within: float = ARRIVAL_DISTANCE) -> Trying:
        """Walk to a destination; return whether it was reached."""
        attempts = 0
        while attempts < 3 and math.isfinite(self.scene.floor.path_length(destination, *self.at)):
            self._set_out(destination, pace)
            while self.walkers.stuck[self.number] <= self._patience:
                yield
                if math.dist(self.at, self.scene.floor.destination(destination)) < within:
                    self.stand()
                    return True
            attempts += 1
            yield from self.step_aside()
        self.stand()
        yield
        return False

    def come_to(self, x: float, y: float, within: float, seconds: float, pace: float | None = None) -> Trying:
        """Walk straight to a point for at most some seconds; return whether it was reached."""
        end = self.scene.now + seconds
        self.approach(x, y, pace)
        while self.scene.now < end:
            yield
            if math.dist(self.at, (x, y)) < within:
                self.stand()
                return True
        self.stand()
        return False

    def step_aside(self) -> Doing:
        """Make way for others: go to the roomiest of some points around, and wait there."""
        self._patience = float(self.rng.uniform(*PATIENCE))
        x, y = self._roomiest_point()
        yield from self.come_to(x, y, 0.1, 1.5)
        yield from self.pause(float(self.rng.uniform(0.3, 1.5)))

    def _set_out(self, destination: int, pace: float | None) -> None:
        w, i = self.walkers, self.number
        w.mode[i], w.pace[i], w.destination[i] = WALK, self.pace if pace is None else pace, destination
        w.aim[i], w.stuck[i] = self.scene.floor.destination(destination), 0.0

    def _roomiest_point(self) -> tuple[float, float]:
        """Return one of some points within a step or two that is clear of walls, people and the robot."""
        x, y = self.at
        floor, best, best_room = self.scene.floor, (x, y), -math.inf
        for ux, uy in self.rng.permutation(self.scene.directions)[:8].tolist():
            reach = float(self.rng.uniform(*STEP_ASIDE_DISTANCES))
            px, py = x + reach * ux, y + reach * uy
            room = min(floor.free(px, py), self.scene.room_at(px, py, self.number))
            if room > best_room and floor.is_clear(x, y, px, py, PERSON_RADIUS):
                best, best_room = (px, py), room
        return best

    def _draw_destination(self) -> tuple[int | None, float]:
        """Return a random destination that can be reached, on a route or anywhere, and the pace there."""
        scene, nearest = self.scene, None
        for _ in range(8):
            on_route = bool(scene.route_ends) and float(self.rng.uniform()) < ROUTE_SHARE
            numbers = scene.route_ends if on_route else scene.anywhere
            number, pace = numbers[int(self.rng.integers(len(numbers)))]
            length = scene.floor.path_length(number, *self.at)
            if MIN_ROUTE_LENGTH < length < math.inf:
                return number, min(self.pace, pace)
            if ARRIVAL_DISTANCE < length < MIN_ROUTE_LENGTH:
                nearest = number
        return nearest, self.pace
