"""A lidar in a room with people on two legs, without the simulator."""

from __future__ import annotations

import math

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.people.observation import Observation, observe_scan
from chefbot.people.tracker import PeopleTracker

BEAMS, HALF_SIDE, PERIOD = 360, 4.0, 0.1
LEG_RADIUS, HALF_STANCE = 0.075, 0.11
ORIGIN = SE2(0.0, 0.0, 0.0)
Disc = tuple[float, float, float]


def legs(x: float, y: float, heading: float) -> list[Disc]:
    """Return x, y and radius of the legs of a person."""
    dx, dy = -HALF_STANCE * math.sin(heading), HALF_STANCE * math.cos(heading)
    return [(x + dx, y + dy, LEG_RADIUS), (x - dx, y - dy, LEG_RADIUS)]


def ranges_of(discs: list[Disc], rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the ranges (BEAMS,) from the middle of a square room to its walls and the discs."""
    angle = -math.pi + 2.0 * math.pi / BEAMS * np.arange(BEAMS)
    ux, uy = np.cos(angle), np.sin(angle)
    ranges = HALF_SIDE / np.maximum(np.abs(ux), np.abs(uy))
    for x, y, radius in discs:
        along, across = x * ux + y * uy, x * uy - y * ux
        with np.errstate(invalid="ignore"):
            hit = along - np.sqrt(radius**2 - across**2)
        ranges = np.where((np.abs(across) < radius) & (hit > 0.1), np.fmin(ranges, hit), ranges)
    noise = rng.normal(0.0, 0.01, BEAMS) if rng is not None else 0.0
    return np.asarray(ranges + noise, np.float32)


def scan_of(ranges: np.ndarray) -> LaserScan:
    """Return the message of a lidar all round."""
    step = 2.0 * math.pi / BEAMS
    return LaserScan(
        angle_min=-math.pi,
        angle_max=math.pi - step,
        angle_increment=step,
        range_min=0.1,
        range_max=12.0,
        ranges=ranges,
    )


def observe(discs: list[Disc], rng: np.random.Generator | None = None) -> Observation:
    """Return what the lidar sees of the discs."""
    return observe_scan(scan_of(ranges_of(discs, rng)), ORIGIN)


class Walk:
    """A tracker that watches people on straight paths, each (x, y, vx, vy); time in seconds."""

    def __init__(
        self, tracker: PeopleTracker, people: list[tuple[float, float, float, float]], seed: int = 1
    ) -> None:
        self.tracker, self.people, self.time = tracker, people, 1000.0
        self._rng = np.random.default_rng(seed)

    def at(self, k: int) -> tuple[float, float]:
        """Return where person k is now."""
        x, y, vx, vy = self.people[k]
        return x + vx * (self.time - 1000.0), y + vy * (self.time - 1000.0)

    def run(self, seconds: float, others: list[Disc] | None = None) -> None:
        """Let time pass, with other discs in the room."""
        for _ in range(round(seconds / PERIOD)):
            discs = list(others or [])
            for k, (_, _, vx, vy) in enumerate(self.people):
                discs += legs(*self.at(k), math.atan2(vy, vx))
            self.tracker.update(observe(discs, self._rng), self.time)
            self.time += PERIOD
