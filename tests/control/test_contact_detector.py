"""What explains that a robot makes no progress: a contact only if the wheels are driven, and can be."""

from __future__ import annotations

import pytest

from chefbot.control.contact_detector import ContactDetector

MS = 1_000_000


def driven(v: float, w: float = 0.0) -> ContactDetector:
    """Return a detector to which a twist was sent from 0 to 2 s."""
    detector = ContactDetector()
    for time_ms in range(0, 2000, 50):
        detector.process(v, w, time_ms * MS)
    return detector


@pytest.mark.parametrize("v", [0.1, -0.1])
def test_driven_wheels_without_progress_are_a_contact(v: float) -> None:
    assert driven(v).explains("", 2000 * MS) and driven(v, 1.0).explains("", 2000 * MS)


def test_a_robot_that_stands_or_turns_touches_nothing() -> None:
    assert not ContactDetector().explains("", 2000 * MS)
    assert not driven(0.0).explains("", 2000 * MS) and not driven(0.0, 1.0).explains("", 2000 * MS)


def test_motors_that_are_off_are_not_a_contact() -> None:
    assert not driven(0.1).explains("The left encoder is silent.", 2000 * MS)


def test_before_the_board_can_report_nothing_is_concluded() -> None:
    detector = driven(0.1)
    detector.process(0.0, 0.0, 2000 * MS)
    assert not detector.explains("", 5000 * MS)
    detector.process(0.0, 0.5, 5000 * MS)
    detector.process(0.1, 0.0, 5500 * MS)
    assert not detector.explains("", 5999 * MS)
    assert detector.explains("", 6000 * MS), "turning drives the wheels, too"
