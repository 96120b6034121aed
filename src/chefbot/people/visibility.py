"""How much of a place a sensor has seen to be free."""

from __future__ import annotations

import math

import numpy as np

from chefbot.people.motion_model import MotionState
from chefbot.people.observation import Observation

BODY = 0.3
"""Distance behind a place up to which nothing must be seen for it to be free, m."""
HALF_WIDTH = 0.12
"""Half the width of a place that must be free, m."""
_RING = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


def seen_free(observation: Observation, state: MotionState) -> float:
    """Return the share, 0 to 1, of where a person may be (the mean and points a deviation away) that was free."""
    points = np.array([state.x, state.y]) + min(state.deviation, 1.0) * _RING
    return sum(_is_free(observation, x, y) for x, y in points.tolist()) / len(points)


def _is_free(observation: Observation, x: float, y: float) -> bool:
    """Return whether all beams through a place pass beyond it."""
    sensor, angles = observation.sensor, observation.angles
    if len(angles) < 2:
        return False
    dx, dy = x - sensor.x, y - sensor.y
    distance = math.hypot(dx, dy)
    if distance < HALF_WIDTH:
        return False
    # bearing from the first beam on, in beams
    bearing = (math.atan2(dy, dx) - sensor.yaw - angles[0]) % (2.0 * math.pi)
    middle = bearing / observation.spacing
    half = max(math.atan2(HALF_WIDTH, distance) / observation.spacing, 1.0)
    low, high = math.floor(middle - half), math.ceil(middle + half)
    beams = np.arange(low, high + 1)
    if abs(len(angles) * observation.spacing - 2.0 * math.pi) < 1.5 * observation.spacing:
        beams %= len(angles)
    elif low < 0 or high >= len(angles):
        return False
    start, end = observation.start[beams], observation.end[beams]
    return bool(((start <= distance) & (end >= distance + BODY)).all())
