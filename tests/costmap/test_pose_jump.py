"""Tests the detection of jumps of the estimated pose: small corrections are a jump only when they add up."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.pose_jump import JUMP_DISTANCE, PoseJumpDetector
from chefbot.maths.se2 import SE2

POSE = SE2(3.0, -2.0, 0.4)


def test_the_first_pose_is_not_a_jump() -> None:
    assert not PoseJumpDetector().process(SE2(5.0, 5.0, 1.0), POSE)


@pytest.mark.parametrize(
    ("correction", "jump"),
    [
        (SE2(0.49, 0.0, 0.0), False),
        (SE2(0.51, 0.0, 0.0), True),
        (SE2(0.0, 0.0, 0.05), False),
        (SE2(0.0, 0.0, math.pi), True),
    ],
)
def test_a_large_correction_is_a_jump_once(correction: SE2, jump: bool) -> None:
    detector = PoseJumpDetector()
    detector.process(SE2(0.0, 0.0, 0.0), POSE)
    assert detector.process(correction, POSE) == jump
    assert not detector.process(correction, POSE)


@given(st.lists(st.floats(0.0, 0.2), max_size=40))
def test_small_corrections_add_up(corrections: list[float]) -> None:
    detector, x, reference = PoseJumpDetector(), 0.0, 0.0
    detector.process(SE2(0.0, 0.0, 0.0), POSE)
    for correction in corrections:
        x += correction
        jumped = detector.process(SE2(x, 0.0, 0.0), POSE)
        if abs(x - reference - JUMP_DISTANCE) > 1e-9:
            assert jumped == (x - reference > JUMP_DISTANCE)
        reference = x if jumped else reference
