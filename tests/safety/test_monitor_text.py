"""The sentences of the collision monitor, and how often they change."""

from __future__ import annotations

import math

import pytest

from chefbot.safety.monitor_text import REPEAT_NS, ReasonKeeper, direction_text, limited_text, unseen_text

LIMIT = "the lidar sees an obstacle 0.12 m ahead on the left"


def test_standing_is_stopped_and_moving_is_slowed() -> None:
    assert limited_text(LIMIT, (0.35, 0.0), (0.0, 0.0)) == f"Stopped: {LIMIT}."
    assert limited_text(LIMIT, (0.35, 0.0), (0.1, 0.0)) == f"Slowed: {LIMIT}."
    assert limited_text(LIMIT, (0.0, 0.0), (0.0, 0.0)) == "" == limited_text("", (0.35, 0.0), (0.35, 0.0))


@pytest.mark.parametrize(
    ("bearing", "words"),
    [
        (0, "ahead"),
        (40, "ahead on the left"),
        (90, "on the left"),
        (-135, "behind on the right"),
        (180, "behind"),
    ],
)
def test_directions_are_eighths_of_a_turn(bearing: float, words: str) -> None:
    assert direction_text(math.cos(math.radians(bearing)), math.sin(math.radians(bearing))) == words


def test_unseen_ground_lies_where_the_robot_drives() -> None:
    ends = ("behind", "beside", "ahead of")
    assert [unseen_text(v) for v in (-0.1, 0.0, 0.1)] == [
        f"no sensor has seen the ground {end} the robot of late" for end in ends
    ]


def test_beginning_and_end_of_a_reason_do_not_wait() -> None:
    keeper = ReasonKeeper()
    assert not keeper.changes("", 0)
    assert keeper.changes("a", 1) and not keeper.changes("a", 2)
    assert not keeper.changes("b", REPEAT_NS) and keeper.changes("b", REPEAT_NS + 1)
    assert keeper.changes("", REPEAT_NS + 2) and keeper.sentence == ""
