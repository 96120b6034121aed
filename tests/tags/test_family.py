"""A pattern of squares is the tag from which it differs least, in any of its four directions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.tags.family import TagPatterns, patterns_of

FAMILY = patterns_of("tag36h11")


@given(st.integers(0, 586), st.integers(0, 3), st.sets(st.integers(0, 35), max_size=5))
def test_up_to_five_wrong_squares_leave_the_tag(number: int, turns: int, wrong: set[int]) -> None:
    white = np.rot90(FAMILY.squares[number], -turns).copy()
    for i in wrong:
        white.flat[i] = not white.flat[i]
    assert FAMILY.nearest(white) == (number, turns, len(wrong))


@pytest.mark.parametrize(
    ("family", "distance"), [("tag16h5", 5), ("tag25h9", 9), ("tag36h10", 10), ("tag36h11", 11)]
)
def test_tags_differ_as_the_family_promises(family: str, distance: int) -> None:
    patterns: TagPatterns = patterns_of(family)  # type: ignore[arg-type]
    signs = patterns._signs.reshape(4, len(patterns.squares), -1)
    upright = signs[0]
    differences = (upright.shape[1] - upright @ signs.reshape(-1, upright.shape[1]).T) / 2
    differences[np.arange(len(upright)), np.arange(len(upright))] = 99  # a tag and itself
    assert differences.min() >= distance
