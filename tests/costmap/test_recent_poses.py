"""Tests of the poses of the last seconds, and of the cells near them."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.cell_masks import disc_mask, discs_mask
from chefbot.costmap.recent_poses import RECENT_TIME, SPACING, RecentPoses
from chefbot.maths.polygon import GridGeometry
from chefbot.maths.se2 import SE2

GRID = GridGeometry(0.05, -2.0, -1.0, 60, 100)
POSES = st.builds(SE2, st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.just(0.0))


def test_the_present_pose_is_always_recent() -> None:
    recent = RecentPoses()
    for i in range(100):
        x = 0.01 * i
        poses = recent.add(SE2(x, 0.0, 0.0), float(i) / 10)
        assert poses[-1].x == x
    assert len(poses) <= 2 + round(x / SPACING)


def test_a_pose_is_forgotten_after_a_time() -> None:
    recent, start, end = RecentPoses(), SE2(0.0, 0.0, 0.0), SE2(9.0, 0.0, 0.0)
    recent.add(start, 0.0)
    assert start in recent.add(end, RECENT_TIME)
    assert start not in recent.add(end, RECENT_TIME + 0.1)


def test_poses_of_a_clock_that_was_set_back_are_forgotten() -> None:
    recent, start, end = RecentPoses(), SE2(0.0, 0.0, 0.0), SE2(9.0, 0.0, 0.0)
    recent.add(start, 1000.0)
    assert recent.add(end, 5.0)[:-1] == [end]


@given(st.lists(POSES, max_size=4), st.floats(0.0, 3.0))
def test_discs_are_the_union_of_their_discs(poses: list[SE2], radius: float) -> None:
    union = np.zeros((GRID.height, GRID.width), np.bool_)
    for pose in poses:
        union |= disc_mask(GRID, pose, radius)
    assert np.array_equal(discs_mask(GRID, poses, radius), union)
