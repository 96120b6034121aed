"""Tests the detection of jumps of the estimated pose: small corrections are a jump only when they add up."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.pose_jump import JUMP_DISTANCE, SLIP_NS, PoseJumpDetector
from chefbot.maths.se2 import SE2

SECOND = 1_000_000_000
POSE = SE2(3.0, -2.0, 0.4)


def test_the_first_pose_is_not_a_jump() -> None:
    assert not PoseJumpDetector().process(SE2(5.0, 5.0, 1.0), POSE, 0)


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
    detector.process(SE2(0.0, 0.0, 0.0), POSE, 0)
    assert detector.process(correction, POSE, 0) == jump
    assert not detector.process(correction, POSE, 0)


@given(st.lists(st.floats(0.0, 0.2), max_size=40))
def test_small_corrections_add_up(corrections: list[float]) -> None:
    detector, x, reference = PoseJumpDetector(), 0.0, 0.0
    detector.process(SE2(0.0, 0.0, 0.0), POSE, 0)
    for correction in corrections:
        x += correction
        jumped = detector.process(SE2(x, 0.0, 0.0), POSE, 0)
        if abs(x - reference - JUMP_DISTANCE) > 1e-9:
            assert jumped == (x - reference > JUMP_DISTANCE)
        reference = x if jumped else reference


@given(st.lists(st.floats(0.0, 0.49), min_size=1, max_size=9))
def test_corrections_of_slipped_wheels_do_not_add_up(corrections: list[float]) -> None:
    detector, x = PoseJumpDetector(), 0.0
    detector.process(SE2(0.0, 0.0, 0.0), POSE, 0)
    detector.note_contact(SECOND)
    for i, correction in enumerate(corrections):
        x += correction
        assert not detector.process(SE2(x, 0.0, 0.0), POSE, (i + 1) * SECOND)
    assert detector.process(SE2(x + 0.6, 0.0, 0.0), POSE, 10 * SECOND), "relocalization is a jump at any time"


def test_long_after_a_contact_corrections_add_up_again() -> None:
    detector = PoseJumpDetector()
    detector.process(SE2(0.0, 0.0, 0.0), POSE, 0)
    detector.note_contact(SECOND)
    assert not detector.process(SE2(0.3, 0.0, 0.0), POSE, SECOND + SLIP_NS)
    assert detector.process(SE2(0.6, 0.0, 0.0), POSE, 2 * SECOND + SLIP_NS)
