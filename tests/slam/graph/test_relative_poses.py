"""Tests relative poses of many pairs against the composition of single ones."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.relative_poses import inverted, relative
from chefbot.slam.motion_model import compose

POSES = st.lists(
    st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-7.0, 7.0)), min_size=1, max_size=8
)


def assert_same(found: np.ndarray, expected: list[SE2]) -> None:
    assert found[:, :2] == pytest.approx(np.array([pose[:2] for pose in expected]), abs=1e-9)
    turns = [math.remainder(a - b.yaw, 2.0 * math.pi) for a, b in zip(found[:, 2], expected, strict=True)]
    assert turns == pytest.approx([0.0] * len(turns), abs=1e-9)


@settings(max_examples=40)
@given(POSES)
def test_each_pose_is_seen_from_its_partner(poses) -> None:
    a, b = np.array(poses), np.array(poses[::-1])
    pairs = zip(poses, poses[::-1], strict=True)
    assert_same(relative(a, b), [SE2(*one).between(SE2(*other)) for one, other in pairs])
    assert compose(a, relative(a, b)) == pytest.approx(b, abs=1e-9), "headings are not wrapped"


@settings(max_examples=40)
@given(POSES)
def test_an_inverse_leads_back(poses) -> None:
    a = np.array(poses)
    assert_same(inverted(a), [SE2(*pose).inverse() for pose in poses])
    assert compose(a, inverted(a)) == pytest.approx(np.zeros_like(a), abs=1e-9)
    assert inverted(inverted(a)) == pytest.approx(a, abs=1e-9)


def test_a_quarter_turn_by_hand() -> None:
    assert relative(np.array([[1.0, 2.0, math.pi / 2]]), np.array([[1.0, 5.0, math.pi]])) == pytest.approx(
        np.array([[3.0, 0.0, math.pi / 2]])
    )
