"""How much of a place a sensor has seen to be free."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chefbot.people.motion_model import MotionState
from chefbot.people.observation import Floats, Observation

BODY_DEPTH = 0.3
"""Distance behind a place up to which nothing must be seen for it to be free, m."""
HALF_WIDTH = 0.12
"""Half the width of a place that must be free, m."""
MAX_SPREAD = 1.0
"""Largest distance from the mean at which places are looked at, m."""
_RING = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


def seen_free(observation: Observation, state: MotionState) -> float:
    """Return the share, 0 to 1, of where a person may be (the mean and points a deviation away) that was free."""
    points = np.array([state.x, state.y]) + min(state.deviation, MAX_SPREAD) * _RING
    first, n = float(observation.angles[0]), len(observation.angles)
    free = _count_free(
        points,
        observation.sensor.array(),
        first,
        (float(observation.angles[-1]) - first) / (n - 1),
        observation.start,
        observation.end,
    )
    return free / len(points)


@njit(cache=True, nogil=True)
def _count_free(
    points: Floats, sensor: Floats, first: float, spacing: float, start: Floats, end: Floats
) -> int:
    """Return the number of points (k, 2) through which all beams pass and show nothing up to BODY_DEPTH behind them.

    sensor: (3,) pose. first, spacing: angle of the first beam and between beams, rad. start, end: (n,) as in
    Observation.
    """
    n, free = len(start), 0
    full_turn = abs(n * spacing - 2.0 * math.pi) < 1.5 * spacing
    for k in range(len(points)):
        dx, dy = points[k, 0] - sensor[0], points[k, 1] - sensor[1]
        distance = math.sqrt(dx * dx + dy * dy)
        if distance < HALF_WIDTH:
            continue
        # Beams that meet the place, counted from the first one.
        middle = ((math.atan2(dy, dx) - sensor[2] - first) % (2.0 * math.pi)) / spacing
        half = max(math.atan2(HALF_WIDTH, distance) / spacing, 1.0)
        low, high = math.floor(middle - half), math.ceil(middle + half)
        if not full_turn and (low < 0 or high >= n):
            continue
        clear = True
        for i in range(low, high + 1):
            clear = clear and start[i % n] <= distance and end[i % n] >= distance + BODY_DEPTH
        free += clear
    return free
