"""The limit before and in slow zones, and the masks that show them to Nav2."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, PREFERRED, SLOW_ZONE, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.safety.speed_limit import fraction_within
from chefbot.zones.filter_masks import keep_out_mask, speed_mask
from chefbot.zones.speed_limits import REACTION_TIME, zone_limit

LIMITS = Limits.of(load_robot("chefbot_lidar"))
SQUARE = ((2.0, -1.0), (4.0, -1.0), (4.0, 1.0), (2.0, 1.0))


def slow(speed: float, name: str = "ramp", kind: str = SLOW_ZONE) -> MapZone:
    return MapZone(name, kind, tuple(Point(x, y, 0.0) for x, y in SQUARE), speed)


def test_inside_the_zone_its_speed_is_the_limit() -> None:
    limit = zone_limit((slow(0.2), slow(0.1, "stairs")), SE2(3.0, 0.0, 1.0), LIMITS)
    assert limit is not None and (limit.speed, limit.zone.name) == (0.1, "stairs")


def test_elsewhere_there_is_no_limit() -> None:
    for pose in (SE2(-3.0, 0.0, 0.0), SE2(1.9, 0.0, math.pi), SE2(1.9, 0.0, math.pi / 2.0)):
        assert zone_limit((slow(0.2),), pose, LIMITS) is None
    assert zone_limit((slow(9.0),), SE2(3.0, 0.0, 0.0), LIMITS) is None
    assert zone_limit((), SE2(3.0, 0.0, 0.0), LIMITS) is None


@given(st.floats(0.1, 0.3), st.floats(0.0, 2.0))
def test_a_robot_that_brakes_enters_at_the_speed_of_the_zone(speed: float, before: float) -> None:
    """It drives as fast as allowed, brakes with half its acceleration and reacts late by the reaction time."""
    x, v, dt, history = 2.0 - before, LIMITS.speed, 0.05, []
    while x < 2.5:
        limit = zone_limit((slow(speed),), SE2(x, 0.0, 0.0), LIMITS)
        history.append(LIMITS.speed if limit is None else limit.speed)
        late = history[max(0, len(history) - 1 - round(REACTION_TIME / dt))]
        v = max(min(late, v + 0.5 * LIMITS.acceleration * dt), v - LIMITS.acceleration * dt)
        if x >= 2.0 and before > LIMITS.speed**2 / LIMITS.acceleration + 1.5 * REACTION_TIME * LIMITS.speed:
            assert v <= speed + 0.05
        x += max(v, 0.01) * dt


@given(st.floats(-2.0, 2.0), st.floats(0.05, 3.0), st.booleans())
def test_a_command_is_scaled_to_the_limit(v: float, limit: float, percentage: bool) -> None:
    message = SpeedLimit(percentage=percentage, speed_limit=100.0 * limit if percentage else limit)
    fraction = fraction_within(message, v, 1.0)
    assert abs(fraction * v) <= limit + 1e-12
    assert fraction == 1.0 or abs(fraction * v) == pytest.approx(limit)
    assert fraction_within(None, v, 1.0) == fraction_within(SpeedLimit(), v, 1.0) == 1.0


def test_the_masks_are_those_of_nav2s_filters() -> None:
    grid = Grid(np.zeros((40, 60), np.int8), 0.1, -1.0, -2.0)
    zones = MapZones(zones=(slow(0.3), slow(0.15, "stairs"), slow(0.0, "hole", KEEP_OUT)))
    keep_out, speed = keep_out_mask(zones, grid), speed_mask(zones, grid)
    assert (keep_out.type, keep_out.grid.at(3.0, 0.0), keep_out.grid.at(0.0, 0.0)) == (0, 100, 0)
    assert speed.type == 2 and speed.grid.at(3.0, 0.0) * speed.multiplier == pytest.approx(0.15)
    assert speed.grid.at(0.0, 0.0) == 0
    liked = keep_out_mask(MapZones(zones=(slow(0.0, "hall", PREFERRED),)), grid)
    assert liked.grid.at(3.0, 0.0) == 0 < liked.grid.at(0.0, 0.0) < 100
