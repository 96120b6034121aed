"""AprilTags are found in pictures, with the right number, corners and pose."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.support.tag_pictures import K, picture_of_tag, project

from chefbot.errors import UserError
from chefbot.robot.sensors import TAG_SQUARES, TagFamily
from chefbot.tags import opencv
from chefbot.tags.detector import TagDetector
from chefbot.tags.family import tag_image
from chefbot.tags.opencv import load_opencv
from chefbot.tags.pose import SQUARE, homography, tag_transform

SIZE = 0.15
FACING = np.diag([1.0, -1.0, -1.0])
"""Rotation of a tag that faces the camera upright: its x right, its y up, its z towards the camera."""
TAG_0 = ["00000000", "01101010", "00111010", "00110000", "01010000", "00101100", "00001000", "00000000"]
"""The published picture of tag36h11 number 0: of each square whether it is white."""


def test_the_picture_of_a_tag_is_the_published_one() -> None:
    rows = ["".join(str(int(value > 0)) for value in row) for row in tag_image("tag36h11", 0)]
    assert rows == TAG_0


@pytest.mark.parametrize("family", get_args(TagFamily))
def test_each_family_has_its_tags_and_no_others(family: TagFamily) -> None:
    picture = picture_of_tag(FACING, np.array([0.05, 0.0, 0.6]), family, 3)
    assert [tag.id for tag in TagDetector(family).detect(picture)] == [3]
    assert len(tag_image(family, 3)) == TAG_SQUARES[family]
    with pytest.raises(ValueError, match=f"family {family} has the tags 0 to .* not 100000"):
        tag_image(family, 100_000)


@settings(max_examples=25, deadline=None)
@given(
    tilt=st.tuples(*[st.floats(-0.6, 0.6)] * 2),
    roll=st.floats(-math.pi, math.pi),
    distance=st.floats(0.3, 1.5),
    aside=st.tuples(st.floats(-0.25, 0.25), st.floats(-0.2, 0.2)),
)
def test_corners_and_pose_are_those_of_the_tag(tilt, roll, distance, aside) -> None:
    rotation = (
        Rotation.from_rotvec([*tilt, 0.0]).as_matrix()
        @ Rotation.from_rotvec([0, 0, roll]).as_matrix()
        @ FACING
    )
    translation = np.array([*aside, 1.0]) * distance
    (tag,) = TagDetector("tag36h11").detect(picture_of_tag(rotation, translation))
    assert tag.id == 7
    assert np.abs(tag.corners - project(SIZE * SQUARE, rotation, translation)).max() < 0.3
    pose = tag_transform(tag.corners, SIZE, K, np.zeros(5))
    assert pose is not None
    t, q = pose.translation, pose.rotation
    assert math.dist((t.x, t.y, t.z), translation) < 0.01 * distance
    error = Rotation.from_quat([q.x, q.y, q.z, q.w]) * Rotation.from_matrix(rotation).inv()
    assert error.magnitude() < 0.1
    assert np.array([q.x, q.y, q.z, q.w]) @ [q.x, q.y, q.z, q.w] == pytest.approx(1.0)


def test_the_homography_maps_the_square_to_the_corners() -> None:
    corners = np.array([(100.0, 210.0), (205.0, 200.0), (200.0, 90.0), (110.0, 100.0)])
    h = homography(corners).reshape(3, 3)
    for (x, y), corner in zip([(-1, 1), (1, 1), (1, -1), (-1, -1)], corners, strict=True):
        image = h @ [x, y, 1.0]
        assert image[:2] / image[2] == pytest.approx(corner, abs=1e-3)


def test_equal_tags_are_in_order_from_the_left() -> None:
    both = picture_of_tag(FACING, np.array([-0.2, 0.0, 1.0]))
    both[:, 320:] = picture_of_tag(FACING, np.array([0.2, 0.0, 1.0]))[:, 320:]
    left, right = TagDetector("tag36h11").detect(both)
    assert left.id == right.id == 7 and left.corners[:, 0].max() < right.corners[:, 0].min()


@pytest.mark.parametrize("grain", [1, 2, 4, 8, 16])
def test_noise_holds_no_tags(grain: int) -> None:
    noise = np.random.default_rng(grain).integers(0, 256, (480 // grain, 640 // grain, 3), np.uint8)
    assert TagDetector("tag36h11").detect(np.kron(noise, np.ones((grain, grain, 1), np.uint8))) == []


@pytest.mark.parametrize("wrong", [1, 2, 3])
def test_a_tag_may_have_two_wrong_squares(wrong: int) -> None:
    at = np.array([0.0, 0.0, 0.5])
    picture = picture_of_tag(FACING, at)
    for i in range(wrong):  # a data square of the tag, painted over
        x, y = (
            (project(np.array([[SIZE * (i / 8 - 3 / 16), SIZE * (5 / 16), 0.0]]), FACING, at)[0])
            .round()
            .astype(int)
        )
        area = picture[y - 7 : y + 8, x - 7 : x + 8]
        area[:] = 255 if area.mean() < 128 else 0
    tags = TagDetector("tag36h11").detect(picture)
    assert [tag.hamming for tag in tags] == ([wrong] if wrong <= 2 else [])


def test_a_small_tag_in_noise_is_found() -> None:
    picture = picture_of_tag(FACING, np.array([0.1, 0.0, 500.0 * SIZE / 18.0]))  # 18 pixels wide
    noisy = picture + np.random.default_rng(1).normal(0.0, 2.0, picture.shape)
    assert [tag.id for tag in TagDetector("tag36h11").detect(np.clip(noisy, 0, 255).astype(np.uint8))] == [7]


def test_opencv_that_is_missing_is_named_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr(opencv.importlib, "import_module", missing)
    with pytest.raises(
        UserError, match=r"sensors.color_camera needs OpenCV.*pip install 'chefbot\[camera\]'"
    ):
        load_opencv("sensors.color_camera")


def test_a_tag_that_two_squares_propose_is_one() -> None:
    (tag,) = TagDetector("tag36h11").detect(picture_of_tag(FACING, np.array([0.0, 0.0, 0.5])))
    assert tag.is_same(tag._replace(corners=tag.corners + 1.0))
    assert not tag.is_same(tag._replace(corners=tag.corners + 5.0))
    assert not tag.is_same(tag._replace(id=8))
