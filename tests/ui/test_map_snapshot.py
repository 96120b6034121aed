"""Tests of the picture of the map about the robot."""

from __future__ import annotations

import io

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.ui.causes.map_snapshot import (
    FREE_COLOUR,
    OBSTACLE_COLOUR,
    PIXELS,
    ROBOT_COLOUR,
    UNKNOWN_COLOUR,
    WALL_COLOUR,
    WIDTH,
    map_snapshot,
)

PLACES = st.floats(-1e9, 1e9)


def room() -> Grid:
    """A room of 10 m x 6 m from (-5, -3) on, with a wall at x = 2 m."""
    cells = np.zeros((120, 200), np.int8)
    cells[:, 140:142] = 100
    return Grid(cells, 0.05, -5.0, -3.0)


def decoded(content: bytes) -> NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB"))


def at(picture: NDArray[np.uint8], x: float, y: float) -> tuple[int, ...]:
    """Return the colour at a place relative to the robot, m; x is to the right and y up."""
    scale = PIXELS / WIDTH
    return tuple(int(value) for value in picture[int(PIXELS / 2 - y * scale), int(PIXELS / 2 + x * scale)])


def test_the_map_lies_about_the_robot() -> None:
    picture = decoded(map_snapshot(room(), SE2(0.5, 0.0, 0.0), 0.2, (1.5, 1.0)))
    assert at(picture, 1.55, -2.0) == WALL_COLOUR
    assert at(picture, 1.0, -2.0) == at(picture, 1.8, 2.0) == FREE_COLOUR
    assert at(picture, 0.0, 3.5) == at(picture, 0.0, -3.5) == UNKNOWN_COLOUR
    assert at(picture, 1.0, 1.0) == OBSTACLE_COLOUR
    assert at(picture, 0.1, 0.0) == ROBOT_COLOUR, "the line from its middle to its front"


def test_the_line_of_the_robot_points_ahead() -> None:
    picture = decoded(map_snapshot(room(), SE2(0.0, 0.0, np.pi / 2), 0.3, None))
    assert at(picture, 0.0, 0.15) == ROBOT_COLOUR
    assert at(picture, 0.15, 0.0) == FREE_COLOUR


@given(x=PLACES, y=PLACES, obstacle=st.none() | st.tuples(PLACES, PLACES))
def test_a_robot_anywhere_gets_a_picture(x: float, y: float, obstacle: tuple[float, float] | None) -> None:
    picture = decoded(map_snapshot(room(), SE2(x, y, 1.0), 0.2, obstacle))
    assert picture.shape == (PIXELS, PIXELS, 3)
