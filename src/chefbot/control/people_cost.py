"""Costs of driving near people, predicted over the time of a trajectory."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2

PROXIMITY = 0.3
"""Standard deviation of the cost over the clearance, m: a third of the cost is left at 0.45 m, where the personal
space begins (Hall 1966)."""
MAX_PERSON_SPEED = 3.0
"""Speed of the fastest person in a building, m/s."""


class NearbyPeople(NamedTuple):
    """People as a controller sees them.

    states: (n, 7), the rows are `MotionState` at present, in the frame of the robot's pose. contact: distance between
    the centres of the robot and of a person at contact, m.
    """

    states: NDArray[np.float64]
    contact: float

    def in_cells(self, pose: SE2, distance: float, seconds: float, costmap: Costmap) -> NDArray[np.float64]:
        """Return the states of the people within reach, with lengths in cells of the costmap.

        distance: that the robot can drive from `pose`, m, within so many seconds.
        """
        reach = distance + MAX_PERSON_SPEED * seconds + self.contact + 4.0 * PROXIMITY
        near = np.hypot(self.states[:, 0] - pose.x, self.states[:, 1] - pose.y) <= reach
        states = np.ascontiguousarray(self.states[near])
        states[:, :2] -= costmap.origin_x, costmap.origin_y
        states[:, :4] /= costmap.resolution
        states[:, 4:] /= costmap.resolution**2
        return states


NOBODY = NearbyPeople(np.zeros((0, 7)), 0.0)


@njit(cache=True, nogil=True)
def person_cost(
    people: NDArray[np.float64], x: float, y: float, time: float, contact: float, proximity: float
) -> float:
    """Return the cost, 0 to 1, of being at (x, y) in `time` seconds: that of the person who is expected nearest then.

    people: states (n, 7) as in `MotionState`. contact: distance between the centres at contact. proximity: standard
    deviation of the cost over the clearance. All lengths are in one unit. Constant velocity (Bar-Shalom, Li and
    Kirubarajan 2001, section 6.2.2); what is uncertain about position and velocity now widens and lowers the cost, as
    the expectation of a Gaussian cost over a Gaussian position does.
    """
    max_cost = 0.0
    for i in range(people.shape[0]):
        # mean and variance of each axis at that time
        dx, dy = x - people[i, 0] - people[i, 2] * time, y - people[i, 1] - people[i, 3] * time
        variance = people[i, 4] + time * (2.0 * people[i, 5] + time * people[i, 6])
        # expected Gaussian cost of the clearance
        clearance = max(math.sqrt(dx * dx + dy * dy) - contact, 0.0)
        spread = proximity * proximity + max(variance, 0.0)
        max_cost = max(
            max_cost, proximity * proximity / spread * math.exp(-clearance * clearance / (2.0 * spread))
        )
    return max_cost


def costliest_person(
    people: NearbyPeople, trajectory: NDArray[np.float64], period: float
) -> tuple[int, float]:
    """Return the row of the person whom a trajectory (n, 3) comes nearest to, and the cost; -1 and 0 for nobody.

    period: time between two poses of the trajectory, s; it begins now.
    """
    best = -1, 0.0
    for row in range(len(people.states)):
        alone = people.states[row : row + 1]
        costs = [
            person_cost(alone, x, y, i * period, people.contact, PROXIMITY)
            for i, (x, y, _) in enumerate(trajectory)
        ]
        best = max(best, (row, max(costs, default=0.0)), key=lambda one: one[1])
    return best
