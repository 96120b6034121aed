"""Ranges of numbers: what a seed draws lies in them, and what is given is checked in a sentence."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.errors import ChefbotError
from chefbot.maths.number_range import NumberRange, check_name


class RangeError(ChefbotError):
    """The error of these tests."""


THOUSANDTHS = st.integers(-(10**6), 10**6).map(lambda k: k / 1000.0)


@given(THOUSANDTHS, THOUSANDTHS, st.integers(0, 1000))
def test_a_drawn_number_is_in_its_range(a: float, b: float, seed: int) -> None:
    one = NumberRange(min(a, b), max(a, b), "m", "a length")
    value = one.draw(np.random.default_rng(seed))
    one.check("length", value, RangeError)
    assert value == round(value, 3), "so that a file that names it gives the same number"


@given(st.integers(-50, 50), st.integers(0, 5), st.integers(0, 1000))
def test_a_count_is_drawn_whole_from_all_of_its_range(low: int, size: int, seed: int) -> None:
    rng, one = np.random.default_rng(seed), NumberRange(low, low + size, "", "a count", whole=True)
    drawn = {one.draw(rng) for _ in range(60 * (size + 1))}
    assert drawn == set(range(low, low + size + 1)), "with both of its ends"


def test_the_same_seed_draws_the_same_numbers() -> None:
    one = NumberRange(0.0, 1.0, "", "a share")
    a, b = ([one.draw(rng) for _ in range(5)] for rng in (np.random.default_rng(3), np.random.default_rng(3)))
    assert a == b and len(set(a)) > 1


@pytest.mark.parametrize("value", [0.5, 0.999, 2.001, -1.0, math.inf, -math.inf, math.nan])
def test_a_number_outside_is_reported_in_one_sentence(value: float) -> None:
    with pytest.raises(RangeError) as caught:
        NumberRange(1.0, 2.0, "m", "a length").check("the width", value, RangeError)
    assert str(caught.value) == f"the width is {value:g}; it must be a number from 1 to 2 m"


@pytest.mark.parametrize(
    ("value", "good"), [(1, True), (3.0, True), (2.5, False), (4, False), (math.nan, False)]
)
def test_a_count_is_a_whole_number(value: float, good: bool) -> None:
    doors = NumberRange(1, 3, "", "doors", whole=True)
    if good:
        doors.check("doors", value, RangeError)
    else:
        with pytest.raises(RangeError, match=r"it must be a whole number from 1 to 3$"):
            doors.check("doors", value, RangeError)


def test_an_unknown_name_has_the_nearest_one() -> None:
    check_name("a robot", "speed", ["speed", "turn"], RangeError)
    with pytest.raises(RangeError, match=r"a robot has no number 'sped' \(did you mean 'speed'\?\)"):
        check_name("a robot", "sped", ["speed", "turn"], RangeError)
