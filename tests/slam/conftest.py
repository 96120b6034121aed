"""Fixtures with a simulated world of walls, laser scans in it, and drives through it with their odometry."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import pytest

from chefbot.maths.se2 import SE2

RING = [
    [(0, 0), (12, 0), (12, 8), (0, 8)],
    [(2.5, 2.5), (9.5, 2.5), (9.5, 5.5), (2.5, 5.5)],
    [(4, 0), (4.6, 0), (4.6, 0.5), (4, 0.5)],
    [(11.5, 3), (12, 3), (12, 3.8), (11.5, 3.8)],
    [(7, 7.3), (7.7, 7.3), (7.7, 8), (7, 8)],
    [(0, 4.4), (0.6, 4.4), (0.6, 5.3), (0, 5.3)],
]
"""A ring corridor 12 m x 8 m with a cupboard on each side."""
CORRIDOR = [[(-30, -1), (30, -1), (30, 1), (-30, 1)]]
ROOM_AND_CORRIDOR = [
    [(0, 0), (6, 0), (6, 2), (40, 2), (40, 4), (6, 4), (6, 6), (0, 6)],
    [(0, 2), (0.5, 2), (0.5, 3.5), (0, 3.5)],
    [(2.5, 2.6), (3.5, 2.6), (3.5, 3.4), (2.5, 3.4)],
    [(4, 5.5), (5, 5.5), (5, 6), (4, 6)],
]
"""A room 6 m x 6 m with cupboards and a bare corridor 34 m long."""


@dataclass(frozen=True)
class World:
    """Closed polygons of walls."""

    walls: np.ndarray

    @staticmethod
    def of(polygons) -> World:
        return World(
            np.array([(*a, *b) for p in polygons for a, b in zip(p, p[1:] + p[:1], strict=True)], float)
        )

    def ranges(self, laser: SE2, angles: np.ndarray, reach: float) -> np.ndarray:
        """Return the range of each beam in metres, shape (n,); inf beyond `reach`."""
        dx, dy = np.cos(angles + laser.yaw)[:, None], np.sin(angles + laser.yaw)[:, None]
        ax, ay, bx, by = self.walls.T
        ex, ey, wx, wy = bx - ax, by - ay, ax - laser.x, ay - laser.y
        with np.errstate(all="ignore"):
            det = dx * ey - dy * ex
            t, u = (wx * ey - wy * ex) / det, (wx * dy - wy * dx) / det
        t = np.where((t > 0) & (u >= 0) & (u <= 1), t, np.inf).min(axis=1)
        return np.where(t < reach, t, np.inf).astype(np.float32)


def ring_drive(laps: float = 1.1, step: float = 0.1) -> list[SE2]:
    """Return poses along a rounded rectangle in the middle of the ring corridor."""
    corners = [(1.4, 1.3), (10.6, 1.3), (10.6, 6.6), (1.4, 6.6)]
    poses, yaw = [], 0.0
    for k in range(round(4 * laps)):
        (ax, ay), (bx, by) = corners[k % 4], corners[(k + 1) % 4]
        length = math.hypot(bx - ax, by - ay)
        poses += [
            SE2(ax + (bx - ax) * s, ay + (by - ay) * s, yaw) for s in np.arange(0, length, step) / length
        ]
        poses += [SE2(bx, by, yaw + turn) for turn in np.linspace(0, math.pi / 2, 8)[:-1]]
        yaw += math.pi / 2
    return poses


def drifting_odometry(
    truth: list[SE2], seed: int, travel: float, heading: float, bias: float = 0.0
) -> list[SE2]:
    """Return odometry of a drive with noise per metre and per radian of each step and a bias in rad per metre."""
    rng = np.random.default_rng(seed)
    odom = [SE2(0, 0, 0)]
    for a, b in itertools.pairwise(truth):
        d = a.between(b)
        length = math.hypot(d.x, d.y)
        scale = 1 + travel * rng.normal()
        turn = d.yaw * (1 + heading * rng.normal()) + length * (bias + heading * rng.normal())
        odom.append(odom[-1] @ SE2(d.x * scale, d.y * scale, turn))
    return odom


@pytest.fixture
def ring() -> World:
    return World.of(RING)


@pytest.fixture
def corridor() -> World:
    return World.of(CORRIDOR)


@pytest.fixture
def room_and_corridor() -> World:
    return World.of(ROOM_AND_CORRIDOR)


@pytest.fixture
def drive():
    """Return a function: `drive(laps)` gives the poses of a drive round the ring."""
    return ring_drive


@pytest.fixture
def odometry():
    """Return a function: `odometry(truth, seed, travel, heading, bias)` gives the noisy odometry of a drive."""
    return drifting_odometry
