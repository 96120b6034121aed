"""Predicted trajectory of a commanded twist, for display."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.robot.motion_limits import Limits

TIME_STEP = 0.1
"""Time between two poses of a trajectory, s."""


def predicted_trajectory(
    pose: SE2,
    twist: tuple[float, float],
    target: tuple[float, float],
    limits: Limits,
    duration: float,
    max_distance: float,
) -> NDArray[np.float64]:
    """Return the poses (n, 3), n >= 1, of a robot that ramps from `twist` to `target` and then holds it.

    The twists are (v, w) in m/s and rad/s. The trajectory begins at `pose`, in whose frame it is, and ends after
    `duration` seconds or at the first pose after `max_distance` metres.
    """
    steps = max(1, round(duration / TIME_STEP))
    change = np.subtract(target, twist)
    ramp = float(np.max(np.abs(change) / (limits.acceleration, limits.angular_acceleration)))
    # twist at the midpoint of every step: a straight ramp, then the target
    middle = (np.arange(steps) + 0.5) * TIME_STEP
    fraction = np.minimum(1.0, middle / ramp) if ramp > 0.0 else np.ones(steps)
    distance, turn = ((np.asarray(twist) + fraction[:, None] * change) * TIME_STEP).T
    # chords in the mean direction of every step
    yaw = pose.yaw + np.concatenate(([0.0], np.cumsum(turn)))
    heading, chord = yaw[:-1] + turn / 2.0, distance * np.sinc(turn / (2.0 * np.pi))
    x = pose.x + np.concatenate(([0.0], np.cumsum(chord * np.cos(heading))))
    y = pose.y + np.concatenate(([0.0], np.cumsum(chord * np.sin(heading))))
    before = np.concatenate(([0.0, 0.0], np.cumsum(np.abs(distance))[:-1]))
    return np.column_stack([x, y, yaw])[before <= max_distance]
