"""Corners of a dark square are refined to its edges, and kept where there are none."""

from __future__ import annotations

import numpy as np
import pytest
from tests.support.tag_pictures import picture_of_tag, project

from chefbot.tags.edges import MAX_SHIFT, refined_corners
from chefbot.tags.pose import SQUARE

FACING = np.diag([1.0, -1.0, -1.0])
AT = np.array([0.021, -0.013, 0.7])
SIZE = 0.15


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 2, 1, 0]])
def test_estimates_two_pixels_off_become_exact(order: list[int]) -> None:
    true = project(SIZE * SQUARE, FACING, AT)[order]
    off = np.random.default_rng(1).uniform(-1.5, 1.5, (4, 2))
    refined = refined_corners(picture_of_tag(FACING, AT)[:, :, 0], true + off)
    assert np.abs(refined - true).max() < 0.05


def test_corners_without_edges_are_kept() -> None:
    corners = np.array([(100.0, 100.0), (200.0, 101.0), (202.0, 200.0), (99.0, 198.0)])
    assert refined_corners(np.full((480, 640), 90, np.uint8), corners) == pytest.approx(corners)


def test_a_corner_does_not_move_far() -> None:
    corners = project(SIZE * SQUARE, FACING, AT) + np.random.default_rng(2).uniform(-8.0, 8.0, (4, 2))
    refined = refined_corners(picture_of_tag(FACING, AT)[:, :, 0], corners)
    assert np.hypot(*(refined - corners).T).max() <= MAX_SHIFT
