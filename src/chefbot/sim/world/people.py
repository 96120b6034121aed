"""Pedestrians who walk back and forth on routes and wait for obstacles in their way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from chefbot.buildings.world_file import Route
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.shapes import SimulatedShape, clearance

PERSONAL_SPACE = 0.3
"""Metres that a person keeps to the robot and to other people."""
OBSTACLE_CLEARANCE = 0.05  # m that a person keeps to doors and boxes
REST = (1.0, 4.0)  # s of rest at the end of a route
BLOCKED_TIMEOUT = (2.0, 5.0)  # s before a blocked person turns around

OccupiedCircle = tuple[float, float, float]
"""x, y, radius of a person or the robot, to be avoided."""


class Pedestrian:
    """A pedestrian on one route; all randomness comes from `rng`."""

    def __init__(self, route: Route, rng: Generator) -> None:
        self._points = np.array(route.points, dtype=np.float64)
        leg_lengths = np.hypot(*np.diff(self._points, axis=0).T)
        self._stations = np.concatenate([[0.0], np.cumsum(leg_lengths)])
        self._rng = rng
        self._speed = route.speed * float(rng.uniform(0.8, 1.2))
        self._direction = float(rng.choice([-1.0, 1.0]))
        self._distance_along = float(rng.uniform(0.0, self._stations[-1]))
        self._rest_left = 0.0
        self._waited = 0.0
        self._patience = float(rng.uniform(*BLOCKED_TIMEOUT))
        self.pose = self._pose(self._distance_along)

    def advance(
        self, duration: float, others: Sequence[OccupiedCircle], obstacles: Sequence[SimulatedShape]
    ) -> None:
        """Walk on for `duration` s, or wait while the way is not free."""
        if self._rest_left > 0.0:
            self._rest_left -= duration
            return
        along = self._distance_along + self._direction * self._speed * duration
        along = min(max(along, 0.0), float(self._stations[-1]))
        pose = self._pose(along)
        if self._blocked(pose, others, obstacles):
            self._wait(duration)
            return
        self._distance_along, self.pose, self._waited = along, pose, 0.0
        if along in (0.0, float(self._stations[-1])):
            self._turn(float(self._rng.uniform(*REST)))

    def _wait(self, duration: float) -> None:
        self._waited += duration
        if self._waited > self._patience:
            self._turn(0.0)

    def _turn(self, rest: float) -> None:
        self._direction, self._rest_left, self._waited = -self._direction, rest, 0.0
        self._patience = float(self._rng.uniform(*BLOCKED_TIMEOUT))

    def _pose(self, along: float) -> SE2:
        # Segment of the polyline at this arc length, then linear interpolation on it.
        segment = min(int(np.searchsorted(self._stations, along, side="right")) - 1, len(self._points) - 2)
        (x0, y0), (x1, y1) = self._points[segment].tolist(), self._points[segment + 1].tolist()
        length = float(self._stations[segment + 1] - self._stations[segment])
        fraction = (along - float(self._stations[segment])) / length
        yaw = math.atan2((y1 - y0) * self._direction, (x1 - x0) * self._direction)
        return SE2(x0 + fraction * (x1 - x0), y0 + fraction * (y1 - y0), yaw)

    def _blocked(
        self, pose: SE2, others: Sequence[OccupiedCircle], obstacles: Sequence[SimulatedShape]
    ) -> bool:
        """Return whether a person or object is too near and the step would bring it even nearer."""
        for x, y, radius in others:
            gap = math.hypot(pose.x - x, pose.y - y)
            if gap < PERSON_RADIUS + radius + PERSONAL_SPACE and gap < self._gap(x, y):
                return True
        near = [s for s in obstacles if math.hypot(s.x - pose.x, s.y - pose.y) < s.reach + 1.0]
        gap = clearance(near, pose.x, pose.y, 0.0, 2.0)
        return gap < PERSON_RADIUS + OBSTACLE_CLEARANCE and gap < clearance(
            near, self.pose.x, self.pose.y, 0.0, 2.0
        )

    def _gap(self, x: float, y: float) -> float:
        return math.hypot(self.pose.x - x, self.pose.y - y)


def place_people(
    routes: Sequence[Route], count: int, robot: OccupiedCircle, rngs: Sequence[Generator]
) -> list[Pedestrian]:
    """Place `count` people on the routes without overlap. Raises UserError if there is no room."""
    if count and not routes:
        raise UserError("this world has no routes for pedestrians; add routes or set people to 0")
    walkers: list[Pedestrian] = []
    for i in range(count):
        discs = [robot, *(disc(w) for w in walkers)]
        walkers.append(_place(routes[i % len(routes)], discs, rngs[i], i))
    return walkers


def _place(route: Route, discs: Sequence[OccupiedCircle], rng: Generator, number: int) -> Pedestrian:
    for _ in range(200):
        walker = Pedestrian(route, rng)
        gaps = [math.hypot(walker.pose.x - x, walker.pose.y - y) - r for x, y, r in discs]
        if min(gaps) > PERSON_RADIUS + PERSONAL_SPACE:
            return walker
    raise UserError(
        f"there is no room for person {number + 1} on this world's routes; reduce the number of people"
    )


def disc(walker: Pedestrian) -> OccupiedCircle:
    """Return the floor area occupied by a person."""
    return walker.pose.x, walker.pose.y, PERSON_RADIUS
