"""What the flat scan and the depth camera together say of a place that somebody has left."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.layers import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import FREE, LETHAL
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.nodes.costmaps import mark_laser, mark_obstacles, plane_of
from chefbot.robot.load import load_robot

HERE = SE2(0.0, 0.0, 0.0)
PLANE = 0.205
"""Metres above the floor at which the lidar of these tests looks."""
METRES = 1.51
"""To what the camera sees; it is blind to the floor around it, which it therefore cannot clear."""


def seen(bottom: float, top: float, metres: float = METRES) -> ObstacleScan:
    """One thing straight ahead, between these heights, and no floor."""
    one = [np.array([value], np.float32) for value in (metres, np.inf, 0.0, bottom, top)]
    return ObstacleScan(
        angle_min=0.0, angle_increment=0.01, range_max=8.0, **dict(zip(FIELDS, one, strict=True))
    )


FIELDS = ("ranges", "clear_from", "clear_to", "bottom", "top")


def scan(metres: float) -> LaserScan:
    """One beam straight ahead."""
    return LaserScan(angle_increment=0.01, range_max=8.0, ranges=np.array([metres], np.float32))


def after(first: ObstacleScan, metres: float, plane: float = PLANE) -> int:
    """Cost where the camera saw `first`, once the flat scan has looked there `metres` far."""
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0, track_unknown=False), 0.16, rolling=True)
    mark_obstacles(costs, HERE, first, plane)
    assert costs.update().at(METRES, 0.01) == LETHAL
    mark_laser(costs, HERE, scan(metres))
    return costs.update().at(METRES, 0.01)


@pytest.mark.parametrize("metres", [2.5, math.inf])
def test_who_has_left_is_forgotten_where_the_laser_looks_through(metres: float) -> None:
    assert after(seen(0.04, 0.6), metres) == FREE


@pytest.mark.parametrize("metres", [METRES, 1.0, math.nan])
def test_who_stands_there_or_may_stand_there_stays(metres: float) -> None:
    assert after(seen(0.04, 0.6), metres) == LETHAL


@given(st.floats(0.03, 0.6), st.floats(0.0, 0.5), st.floats(0.5, 8.0))
def test_what_the_laser_cannot_meet_is_not_its_to_clear(bottom: float, height: float, metres: float) -> None:
    stands_in_it = bottom < PLANE < bottom + height
    assert stands_in_it or after(seen(bottom, bottom + height), metres) == LETHAL


@pytest.mark.parametrize(("bottom", "top"), [(0.04, PLANE + 0.02), (PLANE - 0.02, 0.6)])
def test_what_the_laser_misses_when_the_robot_nods_stays(bottom: float, top: float) -> None:
    assert after(seen(bottom, top), math.inf) == LETHAL


def test_an_obstacle_of_unknown_height_stays() -> None:
    nothing = np.empty(0, np.float32)
    assert after(msgspec.structs.replace(seen(0.04, 0.6), bottom=nothing, top=nothing), math.inf) == LETHAL


def test_without_a_level_plane_nothing_stands_in_it() -> None:
    camera = load_robot("chefbot")
    eye = camera.sensors.depth_camera
    assert eye is not None
    assert plane_of(camera) == eye.mount.z
    tilted = msgspec.structs.replace(eye, mount=msgspec.structs.replace(eye.mount, pitch=0.2))
    sensors = msgspec.structs.replace(camera.sensors, depth_camera=tilted)
    plane = plane_of(msgspec.structs.replace(camera, sensors=sensors))
    assert after(seen(0.04, 0.6), math.inf, plane) == LETHAL


def test_a_table_top_beside_its_leg_stays_when_the_laser_sees_between_the_legs() -> None:
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0, track_unknown=False), 0.16, rolling=True)
    mark_obstacles(costs, HERE, seen(0.41, 0.45), PLANE)
    mark_obstacles(costs, HERE, seen(0.04, 0.45), PLANE)  # the leg, in the same cell
    mark_laser(costs, HERE, scan(3.0))
    assert costs.update().at(METRES, 0.01) == LETHAL
