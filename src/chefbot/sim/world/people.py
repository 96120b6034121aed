"""People who walk to and fro on routes and do not walk into anything that stands in their way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.shapes import Shape, clearance
from chefbot.sim.world.world_spec import Route

COMFORT = 0.3
"""Metres that a person keeps to the robot and to others."""
ARMS_LENGTH = 0.05  # m, to doors and boxes
REST = (1.0, 4.0)  # s at the end of a route
PATIENCE = (2.0, 5.0)  # s before somebody who cannot go on turns round

Disc = tuple[float, float, float]
"""x, y, radius of somebody to keep clear of."""


class Walker:
    """One person on one route; all chance comes from `rng`."""

    def __init__(self, route: Route, rng: Generator) -> None:
        self._points = np.array(route.points, dtype=np.float64)
        steps = np.hypot(*np.diff(self._points, axis=0).T)
        self._stations = np.concatenate([[0.0], np.cumsum(steps)])
        self._rng = rng
        self._speed = route.speed * float(rng.uniform(0.8, 1.2))
        self._direction = float(rng.choice([-1.0, 1.0]))
        self._along = float(rng.uniform(0.0, self._stations[-1]))
        self._rest = 0.0
        self._waited = 0.0
        self._patience = float(rng.uniform(*PATIENCE))
        self.pose = self._pose(self._along)

    def advance(self, duration: float, others: Sequence[Disc], things: Sequence[Shape]) -> None:
        """Walk on for `duration` s, or wait where the way is not free."""
        if self._rest > 0.0:
            self._rest -= duration
            return
        along = self._along + self._direction * self._speed * duration
        along = min(max(along, 0.0), float(self._stations[-1]))
        pose = self._pose(along)
        if self._blocked(pose, others, things):
            self._wait(duration)
            return
        self._along, self.pose, self._waited = along, pose, 0.0
        if along in (0.0, float(self._stations[-1])):
            self._turn(float(self._rng.uniform(*REST)))

    def _wait(self, duration: float) -> None:
        self._waited += duration
        if self._waited > self._patience:
            self._turn(0.0)

    def _turn(self, rest: float) -> None:
        self._direction, self._rest, self._waited = -self._direction, rest, 0.0
        self._patience = float(self._rng.uniform(*PATIENCE))

    def _pose(self, along: float) -> SE2:
        leg = min(int(np.searchsorted(self._stations, along, side="right")) - 1, len(self._points) - 2)
        (x0, y0), (x1, y1) = self._points[leg].tolist(), self._points[leg + 1].tolist()
        length = float(self._stations[leg + 1] - self._stations[leg])
        t = (along - float(self._stations[leg])) / length
        yaw = math.atan2((y1 - y0) * self._direction, (x1 - x0) * self._direction)
        return SE2(x0 + t * (x1 - x0), y0 + t * (y1 - y0), yaw)

    def _blocked(self, pose: SE2, others: Sequence[Disc], things: Sequence[Shape]) -> bool:
        """Somebody or something is too near, and the step would bring it nearer still."""
        for x, y, radius in others:
            gap = math.hypot(pose.x - x, pose.y - y)
            if gap < PERSON_RADIUS + radius + COMFORT and gap < self._gap(x, y):
                return True
        near = [s for s in things if math.hypot(s.x - pose.x, s.y - pose.y) < s.reach + 1.0]
        gap = clearance(near, pose.x, pose.y, 0.0, 2.0)
        return gap < PERSON_RADIUS + ARMS_LENGTH and gap < clearance(near, self.pose.x, self.pose.y, 0.0, 2.0)

    def _gap(self, x: float, y: float) -> float:
        return math.hypot(self.pose.x - x, self.pose.y - y)


def place_people(routes: Sequence[Route], count: int, robot: Disc, rngs: Sequence[Generator]) -> list[Walker]:
    """`count` people spread over the routes, nobody on top of anybody. UserError when there is no room."""
    if count and not routes:
        raise UserError(
            "this world has no routes on which people could walk; give it some or ask for no people"
        )
    walkers: list[Walker] = []
    for i in range(count):
        discs = [robot, *(disc(w) for w in walkers)]
        walkers.append(_place(routes[i % len(routes)], discs, rngs[i], i))
    return walkers


def _place(route: Route, discs: Sequence[Disc], rng: Generator, number: int) -> Walker:
    for _ in range(200):
        walker = Walker(route, rng)
        gaps = [math.hypot(walker.pose.x - x, walker.pose.y - y) - r for x, y, r in discs]
        if min(gaps) > PERSON_RADIUS + COMFORT:
            return walker
    raise UserError(f"there is no room for person {number + 1} on the routes of this world; ask for fewer")


def disc(walker: Walker) -> Disc:
    """The floor that a person takes."""
    return walker.pose.x, walker.pose.y, PERSON_RADIUS
