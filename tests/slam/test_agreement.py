"""Scans of a square room agree with its map where they were measured, and only there."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.grid import UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.agreement import Agreement, agreement
from chefbot.slam.recorded_scan import RecordedScan

HALF, RESOLUTION, MARGIN, RANGE_MAX = 3.0, 0.05, 20, 10.0
ANGLES = np.linspace(-math.pi / 2, math.pi / 2, 181, dtype=np.float32)
LASER = SE2(0.1, 0.0, 0.0)
INSIDE = st.floats(-2.0, 2.0)


def room() -> Grid:
    """Return the map of a square room around (0, 0), unknown outside it."""
    count = round(2 * HALF / RESOLUTION) + 2 * MARGIN
    cells = np.full((count, count), UNKNOWN, np.int8)
    cells[MARGIN - 1 : count - MARGIN + 1, MARGIN - 1 : count - MARGIN + 1] = 100
    cells[MARGIN : count - MARGIN, MARGIN : count - MARGIN] = 0
    corner = -HALF - MARGIN * RESOLUTION
    return Grid(cells, RESOLUTION, corner, corner)


def scan(pose: SE2) -> RecordedScan:
    """Return the scan from a pose of the robot in the room."""
    laser = pose @ LASER
    across, along = np.cos(laser.yaw + ANGLES), np.sin(laser.yaw + ANGLES)
    with np.errstate(divide="ignore"):
        to_x = (np.copysign(HALF, across) - laser.x) / across
        to_y = (np.copysign(HALF, along) - laser.y) / along
    return RecordedScan(0.0, ANGLES, np.minimum(to_x, to_y).astype(np.float32), laser, pose)


@given(INSIDE, INSIDE, st.floats(-math.pi, math.pi))
def test_scans_agree_at_their_own_poses(x: float, y: float, yaw: float) -> None:
    pose = SE2(x, y, yaw)
    assert agreement(room(), [scan(pose)] * 2, [pose] * 2, LASER, RANGE_MAX) == Agreement(362, 0, 362)


@given(INSIDE, INSIDE, st.floats(0.6, 0.9))
def test_scans_of_a_turned_pose_contradict(x: float, y: float, turn: float) -> None:
    found = agreement(room(), [scan(SE2(x, y, 0.0))], [SE2(x, y, turn)], LASER, RANGE_MAX)
    assert found.covered < 0.8


def test_scans_far_from_the_map_cover_nothing() -> None:
    found = agreement(room(), [scan(SE2(0.0, 0.0, 0.0))], [SE2(50.0, 0.0, 0.0)], LASER, RANGE_MAX)
    assert found == Agreement(0, 0, 181)
    assert (found.share, found.covered) == (0.0, 0.0)


def test_beams_without_return_do_not_count() -> None:
    pose = SE2(0.0, 0.0, 0.0)
    short = scan(pose)
    short.ranges[:90] = RANGE_MAX
    assert agreement(room(), [short], [pose], LASER, RANGE_MAX) == Agreement(91, 0, 91)
