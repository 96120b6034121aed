"""The kernel that draws a tag's front over the pixels that see it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.buildings.world_file import WallTag
from chefbot.sim.cameras.tag_faces import TagFace, draw_tag, tag_faces

ROWS, COLUMNS, FOCAL = 60, 80, 80.0
AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Rotation of a camera that looks along +x: its optical axes x right, y down, z ahead as columns."""
CHESSBOARD = np.array([[0, 255], [255, 0]], np.uint8)
"""A front of two by two squares: black above on the left and below on the right."""


def drawn(distance: float = 2.0, yaw: float = np.pi, depth: float | None = None) -> NDArray[np.uint8]:
    """Return the picture (rows, columns), 7 where nothing is drawn, of a front of 0.5 m this far ahead."""
    picture = np.full((ROWS, COLUMNS, 3), 7, np.uint8)
    seen = np.full((ROWS, COLUMNS), distance if depth is None else depth, np.float32)
    face = TagFace(CHESSBOARD, np.array([distance, 0.0, 0.0]), yaw, 0.25)
    draw_tag(*face, np.zeros(3), AHEAD, FOCAL, seen, picture)
    assert (picture[:, :, 0] == picture[:, :, 1]).all() and (picture[:, :, 0] == picture[:, :, 2]).all()
    return picture[:, :, 0]


def test_a_front_is_as_large_as_its_distance_makes_it() -> None:
    rows, columns = np.nonzero(drawn(2.0) != 7)
    # 0.5 m at 2 m and a focal length of 80 pixels: 20 pixels about the middle of the picture.
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (20, 39, 30, 49)
    assert len(rows) == 400


def test_squares_are_seen_upright_and_not_mirrored() -> None:
    picture = drawn(2.0)
    black, white = 25, 229
    assert picture[22, 32] == picture[37, 47] == black
    assert picture[22, 47] == picture[37, 32] == white


@pytest.mark.parametrize(("yaw", "depth"), [(0.0, 2.0), (np.pi, 1.5), (np.pi, 2.2)])
def test_a_back_or_a_hidden_front_is_not_drawn(yaw: float, depth: float) -> None:
    assert (drawn(2.0, yaw, depth) == 7).all()


def test_a_turned_front_is_narrower() -> None:
    # A front turned by 45 degrees lies between 1.82 and 2.18 m; its depth is that of its own plane.
    u = (np.arange(COLUMNS) - 0.5 * (COLUMNS - 1)) / FOCAL
    seen = np.repeat((2.0 / (1.0 + u))[None, :], ROWS, axis=0).astype(np.float32)
    picture = np.full((ROWS, COLUMNS, 3), 7, np.uint8)
    face = TagFace(CHESSBOARD, np.array([2.0, 0.0, 0.0]), np.radians(135.0), 0.25)
    draw_tag(*face, np.zeros(3), AHEAD, FOCAL, seen, picture)
    _, columns = np.nonzero(picture[:, :, 0] != 7)
    assert columns.max() - columns.min() + 1 == pytest.approx(20 * np.cos(np.pi / 4), abs=1.5)


def test_faces_have_a_white_border_and_are_made_once() -> None:
    tags = (WallTag(id=3, size=0.3, x=2.0, y=0.0, z=0.5, yaw=np.pi),)
    (face,) = tag_faces(tags)
    edges = (face.squares[0], face.squares[-1], face.squares[:, 0], face.squares[:, -1])
    assert all((edge == 255).all() for edge in edges)
    assert (face.squares[1, 1:-1] == 0).all()  # the black frame of the tag
    assert face.half == pytest.approx(tags[0].board_size / 2)
    assert tag_faces(tags) is tag_faces(tags)
