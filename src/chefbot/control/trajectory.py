"""Predicted trajectories of commanded twists, for display."""

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
    poses = predicted_trajectories(pose, twist, np.array([target]), limits, duration)[0]
    driven = np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))
    return poses[np.concatenate(([0.0, 0.0], driven[:-1])) <= max_distance]


def predicted_trajectories(
    pose: SE2,
    twist: tuple[float, float],
    targets: NDArray[np.float64],
    limits: Limits,
    duration: float,
) -> NDArray[np.float64]:
    """Return the poses (n, steps + 1, 3) of a robot that ramps from `twist` to each of `targets` (n, 2)."""
    steps = max(1, round(duration / TIME_STEP))
    change = targets - np.asarray(twist)
    ramp = np.max(np.abs(change) / (limits.acceleration, limits.angular_acceleration), axis=1)
    # twist at the midpoint of every step: a straight ramp, then the target
    middle = (np.arange(steps) + 0.5) * TIME_STEP
    fraction = np.minimum(1.0, middle / np.maximum(ramp, 1e-9)[:, None])
    step = (np.asarray(twist) + fraction[:, :, None] * change[:, None, :]) * TIME_STEP
    distance, turn = step[:, :, 0], step[:, :, 1]
    # chords in the mean direction of every step
    yaw = pose.yaw + _from_zero(turn)
    heading, chord = yaw[:, :-1] + turn / 2.0, distance * np.sinc(turn / (2.0 * np.pi))
    x, y = pose.x + _from_zero(chord * np.cos(heading)), pose.y + _from_zero(chord * np.sin(heading))
    return np.stack([x, y, yaw], axis=-1)


def _from_zero(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cumulative sum of each row, from 0 on."""
    return np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))
