"""Goals that show little of what they promised: sooner or later none promises enough."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.exploration.required_gain import GOOD_SHARE, RequiredGain

MINIMUM, ALL_IN_VIEW = 0.08, 28.3
"""The least gain of a goal, and the area within view of it, m^2."""


def test_it_rises_while_goals_show_nothing() -> None:
    required, goals = RequiredGain(MINIMUM), 0
    while required.value <= ALL_IN_VIEW:
        required.update(promised=5.0, shown=0.02)
        goals += 1
    assert 20 < goals < 30, "no goal can promise more than what is in view: the exploration ends"


def test_one_good_goal_makes_up_for_three_poor_ones() -> None:
    required = RequiredGain(MINIMUM)
    for _ in range(3):
        required.update(promised=5.0, shown=0.0)
    assert required.value == pytest.approx(2.0 * MINIMUM)
    required.update(promised=5.0, shown=5.0 * GOOD_SHARE)
    assert required.value == pytest.approx(MINIMUM)


@given(st.lists(st.tuples(st.floats(0.1, 30.0), st.floats(-5.0, 30.0)), max_size=60))
def test_it_is_never_below_its_minimum(goals: list[tuple[float, float]]) -> None:
    required = RequiredGain(MINIMUM)
    for promised, shown in goals:
        required.update(promised, shown)
        assert required.value >= MINIMUM
