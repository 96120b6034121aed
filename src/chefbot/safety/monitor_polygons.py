"""The polygons of the collision monitor: how far a twist has to be free, as functions of the Robot."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot

PLANNED_BRAKING_FRACTION = 0.6
"""Fraction of the maximum acceleration that braking before an obstacle plans with."""
CREEP_SPEED = 0.04
"""Speed of the body where a robot does not see, m/s: a contact at it, below 0.05, harms nobody."""
CELLS_PER_RADIUS = 6
"""Cells of the memory along the inscribed radius."""
CELLS_IN_REACH, MIN_CELLS_PER_RADIUS = 64, 3
"""Number of cells from the robot to the farthest obstacle that matters beyond which a fast robot has larger cells,
and the cells along its inscribed radius that it keeps: the outline is of the body, not of a few cells."""
MAX_LATENCY = 0.5
"""Latency that the memory's size allows for, s."""
OUTLINE_INSET = 0.75
"""Cells by which the outline lies inside the body, so that the cells below it are those that the body covers."""


class MonitorPolygons(NamedTuple):
    """Polygons of one robot as in Nav2's Collision Monitor, circles for a round one; distances in m, speeds in m/s.

    The body is a disc of radius `circumscribed`, or the polygon `corners` (n, 2). The stop polygon is the body grown
    by the side margin, the slow polygon the body grown by the slow margin; what the body sweeps while it brakes is
    Nav2's approach.
    """

    limits: Limits
    inscribed: float
    circumscribed: float
    stop_radius: float
    stop_corners: NDArray[np.float64]
    slow_radius: float
    slow_corners: NDArray[np.float64]
    corners: NDArray[np.float64]
    outline: NDArray[np.float64]
    """Points just inside the edge of the body (n, 2), at most a cell apart."""
    resolution: float
    """Side of a cell of the memory."""
    reach: float
    """Distance from the origin within which an obstacle can matter."""

    @staticmethod
    def of(robot: Robot, side_margin: float, slow_margin: float) -> MonitorPolygons:
        """Return the polygons of a robot; the margins are in metres."""
        footprint, radius = robot.footprint, robot.circumscribed_radius
        limits = Limits.of(robot)
        reach = radius + slow_margin + _stopping_distance(limits)
        finest, coarsest = (robot.inscribed_radius / n for n in (CELLS_PER_RADIUS, MIN_CELLS_PER_RADIUS))
        resolution = min(max(finest, reach / CELLS_IN_REACH), coarsest)
        inset = OUTLINE_INSET * resolution
        return MonitorPolygons(
            limits,
            robot.inscribed_radius,
            radius,
            radius + side_margin,
            footprint.polygon(side_margin),
            radius + slow_margin,
            footprint.polygon(slow_margin),
            footprint.polygon(),
            outline_points(footprint.polygon(-inset), radius - inset, resolution),
            resolution,
            reach,
        )

    def braking_time(self, v: float, w: float) -> float:
        """Return the time in which planned braking stops a twist on its own arc, s."""
        limits = self.limits
        return (
            max(abs(v) / limits.acceleration, abs(w) / limits.angular_acceleration) / PLANNED_BRAKING_FRACTION
        )

    def body_speed(self, v: float, w: float) -> float:
        """Return the speed of the fastest point of the body; a disc that rotates in place does not move outwards."""
        return abs(v) + (abs(w) * self.circumscribed if len(self.corners) else 0.0)

    def reach_of(self, v: float, w: float, latency: float) -> float:
        """Return the distance from the origin within which an obstacle can matter for a twist, m."""
        speed = self.body_speed(v, w)
        return min(self.reach, self.slow_radius + speed * (latency + self.braking_time(v, w)))


def _stopping_distance(limits: Limits) -> float:
    """Return the distance in which the robot stops from its maximum speed, m."""
    braking = limits.speed * limits.speed / (2.0 * PLANNED_BRAKING_FRACTION * limits.acceleration)
    return braking + limits.speed * MAX_LATENCY


def outline_points(corners: NDArray[np.float64], radius: float, spacing: float) -> NDArray[np.float64]:
    """Return points (n, 2), at most `spacing` apart, along a polygon (k, 2), or along a circle without corners."""
    if not len(corners):
        angles = np.linspace(-math.pi, math.pi, math.ceil(2.0 * math.pi * radius / spacing), endpoint=False)
        return radius * np.column_stack([np.cos(angles), np.sin(angles)])
    sides = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.linalg.norm(b - a)) / spacing))
        sides.append(a + (b - a) * np.arange(count)[:, None] / count)
    return np.concatenate(sides)


def safe_fraction(free_time: float, latency: float, braking_time: float) -> float:
    """Return the largest fraction of a twist that stops in time.

    free_time: time for which the whole twist would be free, s. A fraction f moves on for the latency and then brakes
    evenly: f T + f^2 t_b / 2 <= t_free. A time that is not a number is none.
    """
    if not free_time > 0.0:
        return 0.0
    if math.isinf(free_time):
        return 1.0
    # the root of the parabola in the form that keeps its digits for any braking time, zero included
    divisor = latency + math.sqrt(latency * latency + 2.0 * braking_time * free_time)
    return min(1.0, 2.0 * free_time / divisor) if divisor > 0.0 else 1.0
