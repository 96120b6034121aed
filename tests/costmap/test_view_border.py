"""Walls beside a sensor that looks ahead stay marked when they leave its view, and the middle of a view clears."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import LOCAL_COSTMAP
from chefbot.costmap.sources import LASER
from chefbot.maths.costs import LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.se2 import SE2

WALL = (1.0, 3.0)
"""x of both ends of the wall, m."""
AHEAD = SE2(0.0, 0.0, 0.0)


def rolling_costmap() -> LayeredCostmap:
    return LayeredCostmap(LOCAL_COSTMAP, disc(0.2), rolling=True)


def lethal(costs: LayeredCostmap) -> NDArray[np.bool_]:
    return costs.source_cells(LASER) == LETHAL


def wall_ranges(pose: SE2, angles: NDArray[np.float64], y: float) -> NDArray[np.float64]:
    """Return the ranges of beams to a wall parallel to the x axis, inf beside it."""
    with np.errstate(divide="ignore"):
        ranges = np.where(np.sin(pose.yaw + angles) > 0.0, y / np.sin(pose.yaw + angles), np.inf)
    x = pose.x + ranges * np.cos(pose.yaw + angles)
    return np.where((x > WALL[0]) & (x < WALL[1]), ranges, np.inf)


@pytest.mark.parametrize("seed", range(1, 40, 2))
def test_a_wall_beside_the_way_stays(seed: int) -> None:
    """At any distance, view and heading of a drive along it: all but the two columns at the ends of the wall."""
    rng = np.random.default_rng(seed)
    y, view, yaw = rng.uniform(0.4, 0.8), rng.uniform(1.1, 1.5), rng.uniform(-0.15, 0.15)
    costs, angles = rolling_costmap(), np.linspace(-view / 2.0, view / 2.0, 320)
    marked = np.zeros(costs.shape[1], np.bool_)
    for x in np.arange(0.0, 1.6, 0.03):
        pose = SE2(float(x), 0.0, yaw + rng.normal(0.0, 0.003))
        ranges = wall_ranges(pose, angles, y) + rng.normal(0.0, 0.002, len(angles))
        costs.mark_and_clear(LASER, pose, angles, ranges)
        marked |= lethal(costs).any(axis=0)
    assert marked.sum() >= 5
    assert (marked & ~lethal(costs).any(axis=0)).sum() <= 2


def marked_at(bearing: float, view: float, beams: int) -> tuple[LayeredCostmap, NDArray[np.float64]]:
    """Return a costmap with one mark a metre away, and the angles of a scan that looks ahead."""
    costs, angles = rolling_costmap(), np.linspace(-view / 2.0, view / 2.0, beams)
    costs.mark_and_clear(LASER, AHEAD, np.array([bearing]), np.array([1.0]))
    assert lethal(costs).sum() == 1
    return costs, angles


@pytest.mark.parametrize(
    ("bearing", "view", "beams", "stays"),
    [
        (0.0, 1.2, 320, False),
        (0.5, 1.2, 320, False),
        (0.58, 1.2, 320, True),
        (-0.58, 1.2, 320, True),
        (0.0, 0.05, 8, False),  # narrower than a cell
        (math.pi, 2.0 * math.pi * 359 / 360, 360, False),  # a full turn has no border
    ],
)
def test_a_mark_goes_where_the_view_is_free_around_it(
    bearing: float, view: float, beams: int, stays: bool
) -> None:
    costs, angles = marked_at(bearing, view, beams)
    costs.mark_and_clear(LASER, AHEAD, angles, np.full(beams, np.inf))
    assert lethal(costs).any() == stays


def test_the_view_ends_where_beams_have_no_range() -> None:
    """Too near beside the camera there are none, and the wall goes on."""
    costs, angles = marked_at(0.4, 1.2, 320)
    ranges = np.where(angles > 0.42, np.nan, np.inf)
    costs.mark_and_clear(LASER, AHEAD, angles, ranges)
    assert lethal(costs).any()
    costs.mark_and_clear(LASER, AHEAD, angles[::-1], np.full(len(angles), np.inf))
    assert not lethal(costs).any()
