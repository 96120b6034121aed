"""Fixtures with a simulated hotel: walls as segments, its occupancy grid, exact laser scans, and drives."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.particle_filter import BeamEnds, FilterModels, ParticleFilter
from chefbot.localization.pose_bins import PoseBins
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

RESOLUTION = 0.05
Segment = tuple[float, float, float, float]


def box(x: float, y: float, w: float, h: float) -> list[Segment]:
    return [(x, y, x + w, y), (x + w, y, x + w, y + h), (x + w, y + h, x, y + h), (x, y + h, x, y)]


def room(x: float, y: float, w: float, h: float, door: float, south: bool) -> list[Segment]:
    """Return four walls with a door of 0.9 m in the south or north wall, at `door` metres from the west corner."""
    front, back = (y, y + h) if south else (y + h, y)
    return [
        (x, back, x + w, back),
        (x, y, x, y + h),
        (x + w, y, x + w, y + h),
        (x, front, x + door, front),
        (x + door + 0.9, front, x + w, front),
    ]


@dataclass
class World:
    segments: NDArray[np.float64]
    grid: Grid

    def cast(self, laser: SE2, angles: NDArray[np.float64], range_max: float) -> NDArray[np.float64]:
        """Return the exact range of each beam in metres, shape (n,); inf beyond range_max."""
        direction = np.stack([np.cos(angles + laser.yaw), np.sin(angles + laser.yaw)])[:, :, None]
        x1, y1, x2, y2 = self.segments.T[:, None, :]
        ex, ey = x2 - x1, y2 - y1
        qx, qy = x1 - laser.x, y1 - laser.y
        cross = direction[0] * ey - direction[1] * ex
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (qx * ey - qy * ex) / cross
            u = (qx * direction[1] - qy * direction[0]) / cross
            t[~((u >= 0) & (u <= 1) & (t > 0))] = np.inf
        nearest = t.min(axis=1)
        return np.where(nearest < range_max, nearest, np.inf)


def rasterise(segments: NDArray[np.float64], width: float, height: float) -> Grid:
    """Return the grid of the walls: free inside, with an unknown border of one cell."""
    cells = np.zeros((round(height / RESOLUTION) + 2, round(width / RESOLUTION) + 2), np.int8)
    grid = Grid(cells, RESOLUTION, -RESOLUTION, -RESOLUTION)
    for x1, y1, x2, y2 in segments:
        n = math.ceil(math.hypot(x2 - x1, y2 - y1) / 0.01) + 1
        for x, y in zip(np.linspace(x1, x2, n), np.linspace(y1, y2, n), strict=True):
            cells[grid.cell(x, y)] = 100
    return grid


def build(seed: int) -> World:
    """Return a hotel of 15 x 12 m: a corridor, seven furnished rooms of the same size, and a lobby."""
    rng = np.random.default_rng(seed)
    walls = box(0.02, 0.02, 14.96, 11.96)
    for k in range(4):
        walls += room(0.02 + 3.75 * k, 7.2, 3.7, 4.75, 1.4, south=True)
    for k in range(3):
        walls += room(0.02 + 3.75 * k, 0.05, 3.7, 4.75, 1.4, south=False)
    walls += furniture(rng)
    segments = np.array(walls)
    return World(segments, rasterise(segments, 15.0, 12.0))


def furniture(rng: np.random.Generator) -> list[Segment]:
    """Return a bed and a chair for each room and six tables for the lobby."""
    out: list[Segment] = []
    for k in range(4):
        x = 0.02 + 3.75 * k
        out += box(x + rng.uniform(0.1, 1.6), 10.0, 1.4, 1.9)
        out += box(x + rng.uniform(0.3, 3.0), rng.uniform(8.4, 9.2), 0.45, 0.45)
        if k < 3:
            out += box(x + rng.uniform(0.1, 1.6), 0.1, 1.4, 1.9)
            out += box(x + rng.uniform(0.3, 3.0), rng.uniform(2.8, 3.4), 0.45, 0.45)
    for _ in range(6):
        out += box(rng.uniform(11.6, 14.2), rng.uniform(0.4, 4.6), 0.4, 0.4)
    return out


ROUTE = [
    (1.8, 6.0),
    (5.6, 6.0),
    (5.6, 7.9),
    (5.6, 6.0),
    (9.4, 6.0),
    (9.4, 4.0),
    (9.4, 6.0),
    (12.9, 6.0),
    (12.9, 5.1),
]


def drive(route: list[tuple[float, float]], step: float = 0.05, turn: float = 0.08) -> list[SE2]:
    """Return true poses along the route, with rotations in place between straight lines."""
    poses = [SE2(*route[0], 0.0)]
    for x, y in route[1:]:
        here = poses[-1]
        wanted = math.atan2(y - here.y, x - here.x)
        change = SE2(0, 0, here.yaw).between(SE2(0, 0, wanted)).yaw
        n = max(1, math.ceil(abs(change) / turn))
        poses += [SE2(here.x, here.y, here.yaw + change * (i + 1) / n) for i in range(n)]
        m = math.ceil(math.hypot(x - here.x, y - here.y) / step)
        poses += [
            SE2(here.x + (x - here.x) * (i + 1) / m, here.y + (y - here.y) * (i + 1) / m, wanted)
            for i in range(m)
        ]
    return poses


def odometry(truth: list[SE2], seed: int) -> list[SE2]:
    """Return odometry with 1 % scale error, a drift of 1 degree per 10 m and noise; it starts at its own origin."""
    rng = np.random.default_rng(seed)
    out = [SE2(0.0, 0.0, 0.0)]
    for a, b in itertools.pairwise(truth):
        d = a.between(b)
        length = math.hypot(d.x, d.y)
        noisy = SE2(
            d.x * 1.01 + rng.normal(0, 0.001),
            d.y,
            d.yaw * 1.002 + math.radians(0.1) * length + rng.normal(0, 0.001),
        )
        out.append(out[-1] @ noisy)
    return out


@dataclass
class Sensor:
    """A lidar, or a depth camera whose noise grows with the square of the depth."""

    angles: NDArray[np.float64]
    range_min: float
    range_max: float
    mount: SE2
    depth: bool

    def scan(self, world: World, base: SE2, rng: np.random.Generator) -> NDArray[np.float64]:
        r = world.cast(base @ self.mount, self.angles, self.range_max)
        z = np.where(np.isfinite(r), r, 0.0) * np.cos(self.angles)
        sigma = 0.002 * z**2 / np.cos(self.angles) if self.depth else 0.01
        r = r + rng.normal(size=r.size) * sigma
        return np.where((r < self.range_min) | (r > self.range_max), np.inf, r)


@pytest.fixture(scope="session")
def hotel() -> World:
    return build(3)


@pytest.fixture(scope="session")
def lidar() -> Sensor:
    return Sensor(np.linspace(-np.pi, np.pi, 360, endpoint=False), 0.12, 8.0, SE2(0.0, 0.0, 0.0), False)


@pytest.fixture(scope="session")
def depth_camera() -> Sensor:
    half = math.radians(29.0)
    return Sensor(np.linspace(-half, half, 320), 0.45, 8.0, SE2(0.09, 0.0, 0.0), True)


class Drives:
    """Drives through the hotel: true poses and odometry."""

    def route(self, seed: int) -> tuple[list[SE2], list[SE2]]:
        """Drive along the corridor, into a room on each side and into the lobby."""
        truth = drive(ROUTE)
        return truth, odometry(truth, seed)

    def from_room(self, k: int) -> tuple[list[SE2], list[SE2]]:
        """Drive out of the k-th room north of the corridor, and along it."""
        door = 1.87 + 3.75 * k
        truth = drive([(door, 8.0), (door, 6.0), (door + (2.0 if k < 2 else -2.0), 6.0)])
        return truth, odometry(truth, k)

    def kidnapped(self, after: int) -> tuple[list[SE2], list[SE2]]:
        """Drive with a kidnapping after `after` scans, which odometry does not measure."""
        before = drive(ROUTE)[:after]
        rest = drive([(9.4, 6.0), (5.6, 6.0), (5.6, 4.0), (5.6, 6.0), (1.8, 6.0), (1.8, 8.0)])
        odom = odometry(before, 1)
        return before + rest, odom + [odom[-1] @ o for o in odometry(rest, 2)]

    def people(self, count: int) -> NDArray[np.float64]:
        """Return segments (4 count, 4) of square people at least half a metre from the route."""
        rng = np.random.default_rng(9)
        path = np.array([pose[:2] for pose in drive(ROUTE)])
        out: list[Segment] = []
        while len(out) < 4 * count:
            x, y = rng.uniform(1.0, 14.0), rng.uniform(4.9, 7.0)
            if np.hypot(*(path - (x, y)).T).min() > 0.5:
                out += box(x - 0.15, y - 0.15, 0.3, 0.3)
        return np.array(out)


@pytest.fixture(scope="session")
def twin_rooms() -> World:
    """Two closed rooms of the same shape, each without one of its corners, displaced by a whole number of cells."""
    walls: list[Segment] = []
    for x in (0.52, 6.52):
        walls += box(x, 0.02, 3.5, 4.5) + box(x, 0.02, 1.0, 0.7)
    segments = np.array(walls)
    return World(segments, rasterise(segments, 10.5, 5.0))


@pytest.fixture(scope="session")
def drives() -> Drives:
    return Drives()


def turn_in_a_twin_room(twin_rooms: World, grid: Grid, lidar: Any, seed: int) -> Iterator[ParticleFilter]:
    """Yield a filter with half of its particles in each of two equal rooms, at each scan of a robot that turns.

    grid: the map, which may differ from what the lidar sees.
    """
    params, rng = AmclParams(seed=seed), np.random.default_rng(seed)
    model = FilterModels(params, LikelihoodField.of(grid, params), PoseBins(grid), rng)
    rooms = np.array([[2.48, 2.0, 0.0], [8.48, 2.0, 0.0]])
    particles = ParticleFilter(np.repeat(rooms, 2500, axis=0) + rng.normal(size=(5000, 3)) * 0.1, model)
    for k in range(60):
        ranges = lidar.scan(twin_rooms, SE2(2.48, 2.0, 0.1 * k), rng)
        ends = np.stack([ranges * np.cos(lidar.angles), ranges * np.sin(lidar.angles)], axis=1)
        particles.propagate(SE2(0.0, 0.0, 0.1 if k else 0.0))
        particles.correct(BeamEnds.of(lidar.angles, ends, params))
        yield particles
