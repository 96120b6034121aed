"""Wrong squares of a tag are counted, and its contrast is measured."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.tag_pictures import picture_of_tag, project

from chefbot.tags.brightness import brightness_at
from chefbot.tags.decoding import read_squares
from chefbot.tags.family import tag_image
from chefbot.tags.pose import SQUARE, homography

ROTATION, AT = np.diag([1.0, -1.0, -1.0]), np.array([0.02, -0.01, 0.7])
GREY = picture_of_tag(ROTATION, AT)[:, :, 0]
MATRIX = homography(project(0.15 * SQUARE, ROTATION, AT))


def test_the_data_squares_are_read() -> None:
    reading = read_squares(GREY, MATRIX, 6)
    assert np.array_equal(reading.white, tag_image("tag36h11", 7)[1:-1, 1:-1] > 0)
    assert reading.wrong_border == 0


@given(st.sets(st.integers(0, 7), max_size=8))
def test_bright_squares_of_the_border_are_counted(bright: set[int]) -> None:
    grey = GREY.copy()
    for i in bright:
        corner = np.array([[0.15 * (i - 4) / 8, 0.15 * 0.5, 0.0], [0.15 * (i - 3) / 8, 0.15 * 3 / 8, 0.0]])
        (left, top), (right, bottom) = project(corner, ROTATION, AT).round().astype(int)
        grey[top : bottom + 1, left : right + 1] = 255
    assert read_squares(grey, MATRIX, 6).wrong_border == len(bright)


@pytest.mark.parametrize("contrast", [1.0, 0.5, 0.1])
def test_the_margin_is_half_the_contrast(contrast: float) -> None:
    reading = read_squares(np.round(100 + contrast * (GREY - 100.0)).astype(np.uint8), MATRIX, 6)
    assert reading.contrast == pytest.approx(255 * contrast, rel=0.05)
    assert reading.margin == pytest.approx(reading.contrast / 2.0, rel=0.05)


def test_brightness_is_interpolated_between_pixels() -> None:
    ramp = np.array([[0, 100], [200, 100]], np.uint8)
    x, y = np.array([0.0, 0.5, 1.0, 0.5, -3.0]), np.array([0.0, 0.0, 1.0, 0.5, 9.0])
    assert brightness_at(ramp, x, y).tolist() == [0.0, 50.0, 100.0, 100.0, 200.0]


def test_a_square_whose_corners_lie_on_a_line_has_no_contrast() -> None:
    flat = np.array([(10.0, 10.0), (20.0, 20.0), (30.0, 30.0), (20.0, 20.1)])
    assert read_squares(GREY, homography(flat), 6).contrast == 0.0
