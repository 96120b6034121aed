"""What a sensor sees of a room whose walls are known."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2

Array = NDArray[np.float64]
CAMERA, LIDAR = np.radians(58.0), 2.0 * np.pi
NOISE, LOOKS, REACH = 0.002, 10, 5.0
"""1/m: deviation of a camera's depth by its square; scans of a stand; m up to which it is used."""


def box(x: float, y: float, width: float, depth: float) -> list[tuple[float, float, float, float]]:
    """Four sides, x1, y1, x2, y2 each."""
    a, b, c, d = x - width / 2, y - depth / 2, x + width / 2, y + depth / 2
    return [(a, b, c, b), (c, b, c, d), (c, d, a, d), (a, d, a, b)]


def drum(x: float, y: float, radius: float) -> list[tuple[float, float, float, float]]:
    """A round thing, by 48 sides."""
    angles = np.linspace(0.0, 2.0 * np.pi, 49)
    rim = np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)]).tolist()
    return [(a[0], a[1], b[0], b[1]) for a, b in pairwise(rim)]


WORKSHOP = [
    *box(1.4, 1.1, 6.0, 5.0),
    *box(1.3, 3.3, 1.6, 0.6),
    *box(4.1, 0.2, 0.5, 1.0),
    *box(-1.35, 2.4, 0.4, 1.2),
    *box(3.0, -1.15, 0.6, 0.4),
    *box(-0.9, -1.15, 0.5, 0.4),
]
"""6 by 5 m, the robot's first square in the middle, things along the walls."""
WALL = [(-50.0, 3.0, 50.0, 3.0)]
"""One alone, 3 m to the left of the origin."""


def seen(
    room: Sequence[tuple[float, float, float, float]],
    sensor: SE2,
    rng: np.random.Generator,
    view: float = CAMERA,
    beams: int = 160,
) -> Array:
    """Mean ends (n, 2) m of a stand's beams in the sensor's frame."""
    angles = np.linspace(-view / 2, view / 2, beams)
    rays = np.column_stack([np.cos(sensor.yaw + angles), np.sin(sensor.yaw + angles)])
    walls = np.array(room)
    start, along = walls[:, :2] - (sensor.x, sensor.y), walls[:, 2:] - walls[:, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = rays[:, None, 0] * along[:, 1] - rays[:, None, 1] * along[:, 0]
        far = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / cross
        share = (start[:, 0] * rays[:, None, 1] - start[:, 1] * rays[:, None, 0]) / cross
    ranges = np.where((far > 0.3) & (share >= 0.0) & (share <= 1.0), far, np.inf).min(axis=1)
    ranges = ranges + NOISE / np.sqrt(LOOKS) * np.minimum(ranges, REACH) ** 2 * rng.standard_normal(beams)
    near = ranges < REACH
    return np.asarray((ranges * (np.cos(angles), np.sin(angles))).T[near])
