"""Marks of drop-offs: only the camera clears them, and only where it would see them again."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.costmap.conversions import ObstacleMarking, mark_laser, mark_obstacles
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sources import DROP_OFFS
from chefbot.maths.costs import FREE, LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan

MARKING = ObstacleMarking(plane=0.3, drop_range=1.4, unseen_from=0.23)
ANGLES = np.linspace(-0.3, 0.3, 61)


def scan(distance: float, *, bottom: float = -0.17, clear: tuple[float, float] = (0.72, 4.0)) -> ObstacleScan:
    """Return an obstacle scan with a drop-off at a distance in all directions, inf for none."""
    n = len(ANGLES)
    near = np.full(n, min(distance, clear[1]) if clear[1] else 0.0, np.float32)
    low = np.full(n, bottom if np.isfinite(distance) else np.inf, np.float32)
    top = np.full(n, 0.0 if np.isfinite(distance) else -np.inf, np.float32)
    arrays = (np.full(n, distance, np.float32), np.full(n, clear[0], np.float32), near, low, top)
    return ObstacleScan(
        angle_min=-0.3, angle_increment=0.01, range_max=8.0, **dict(zip(FIELDS, arrays, strict=True))
    )


FIELDS = ("ranges", "clear_from", "clear_to", "bottom", "top")


def costs_with(distance: float) -> LayeredCostmap:
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0, track_unknown=False), disc(0.15), rolling=True)
    mark_obstacles(costs, IDENTITY, scan(distance), MARKING)
    return costs


def at_edge(costs: LayeredCostmap, distance: float) -> int:
    return costs.update().at(distance, 0.01)


def test_a_drop_off_is_lethal_and_a_flat_scan_keeps_it() -> None:
    costs = costs_with(1.01)
    mark_laser(
        costs,
        IDENTITY,
        LaserScan(angle_min=-0.3, angle_increment=0.01, range_max=8.0, ranges=np.full(61, 5.0)),
    )
    assert at_edge(costs, 1.01) == LETHAL and costs.source_cells("camera").max() != LETHAL


@pytest.mark.parametrize(("seen_from", "cost"), [(0.0, FREE), (-0.8, LETHAL)])
def test_the_camera_clears_it_from_near_only(seen_from: float, cost: int) -> None:
    costs = costs_with(1.01)
    mark_obstacles(costs, SE2(seen_from, 0.0, 0.0), scan(np.inf), MARKING)
    assert at_edge(costs, 1.01) == cost


def test_an_edge_in_the_blind_zone_stays_where_it_was_seen() -> None:
    costs = costs_with(1.01)
    mark_obstacles(costs, SE2(0.6, 0.0, 0.0), scan(0.8, clear=(np.inf, 0.0)), MARKING)
    assert at_edge(costs, 1.01) == LETHAL and at_edge(costs, 0.6 + 0.24) != LETHAL


def test_an_edge_that_was_never_seen_is_assumed_near() -> None:
    costs = costs_with(np.inf)
    mark_obstacles(costs, IDENTITY, scan(0.8, clear=(np.inf, 0.0)), MARKING)
    assert at_edge(costs, 0.24) == LETHAL


def test_it_stays_under_the_edge_of_the_robot() -> None:
    costs = costs_with(1.01)
    costs.clear_footprint(SE2(0.92, 0.0, 0.0), keep=(DROP_OFFS,))
    assert at_edge(costs, 1.01) == LETHAL
    costs.clear_footprint(SE2(0.92, 0.0, 0.0))
    assert at_edge(costs, 1.01) != LETHAL


def test_without_drop_offs_there_is_no_layer() -> None:
    costs = costs_with(np.inf)
    assert not costs.has_source(DROP_OFFS)


def test_a_drop_off_at_a_huge_distance_takes_no_time() -> None:
    costs = costs_with(np.inf)
    mark_obstacles(costs, IDENTITY, scan(1e30, clear=(np.inf, 0.0)), MARKING)
    mark_obstacles(costs, IDENTITY, seen_to(-1e30, 2.0), MARKING)
    assert at_edge(costs, 0.24) == LETHAL


def test_the_ground_behind_an_edge_is_marked() -> None:
    """Around the end of a hole's edge the robot would turn into the hole, whose other edge is too near to be seen."""
    costs = costs_with(1.01).update()
    assert [costs.at(x, y) for x in (1.01, 1.2, 1.48) for y in (-0.2, 0.01, 0.2)] == [LETHAL] * 9
    assert costs.at(1.6, 0.01) != LETHAL and costs.at(0.9, 0.01) != LETHAL


def seen_to(distance: float, lower_to: float) -> ObstacleScan:
    """Return a scan of a hole from an edge at a distance to its far side."""
    lower = np.full(len(ANGLES), lower_to, np.float32)
    return msgspec.structs.replace(scan(distance), lower_to=lower)


def test_a_wide_hole_is_marked_up_to_its_far_side() -> None:
    costs = costs_with(np.inf)
    mark_obstacles(costs, IDENTITY, seen_to(1.01, 1.9), MARKING)
    assert [costs.update().at(x, 0.01) == LETHAL for x in (1.01, 1.4, 1.8, 2.0)] == [True, True, True, False]


@pytest.mark.parametrize(
    ("lower_to", "marked"), [(np.inf, False), (np.nan, False), (-1e30, False), (-np.inf, False), (1e30, True)]
)
def test_an_impossible_far_side_is_none_or_the_range(lower_to: float, marked: bool) -> None:
    costs = costs_with(np.inf)
    mark_obstacles(costs, IDENTITY, seen_to(1.01, lower_to), MARKING)
    assert costs.update().at(1.01, 0.01) == LETHAL
    assert (costs.update().at(1.6, 0.01) == LETHAL) == marked


def test_floor_that_was_seen_behind_a_hole_stays_free() -> None:
    costs = costs_with(1.01)
    other_side = scan(np.inf, clear=(0.72, 1.1))
    mark_obstacles(costs, SE2(2.4, 0.0, math.pi), other_side, MARKING)
    mark_obstacles(costs, IDENTITY, scan(1.01), MARKING)
    assert [costs.update().at(x, 0.01) == LETHAL for x in (1.01, 1.2, 1.35, 1.48)] == [
        True,
        True,
        False,
        False,
    ]
