"""Numbers on the command line, as NAME=VALUE."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.cli.given_numbers import given_numbers
from chefbot.errors import UserError

NAMES = st.text("abcxyz_", min_size=1, max_size=8)


@settings(max_examples=40)
@given(st.dictionaries(NAMES, st.floats(allow_nan=False, allow_infinity=False), max_size=5))
def test_numbers_that_are_written_are_read(numbers: dict[str, float]) -> None:
    assert given_numbers([f"{name}={value!r}" for name, value in numbers.items()], "a=1") == numbers


def test_the_last_one_of_a_name_counts() -> None:
    assert given_numbers(["a=1", "b=2", "a=-3e-2"], "a=1") == {"a": -0.03, "b": 2.0}
    assert given_numbers([], "a=1") == {}


@pytest.mark.parametrize("text", ["radius", "radius=", "=", "radius=wide", "radius=0.2 m", "radius=1=2", ""])
def test_what_is_not_a_number_has_a_sentence_with_an_example(text: str) -> None:
    with pytest.raises(UserError) as caught:
        given_numbers(["a=1", text], "radius=0.2")
    assert str(caught.value) == f"--set {text}: give a name and a number, as --set radius=0.2"


@pytest.mark.parametrize("text", ["a=inf", "a=-inf", "a=nan", "a=1e999"])
def test_a_number_is_finite(text: str) -> None:
    with pytest.raises(UserError, match="give a finite number"):
        given_numbers([text], "a=1")


def test_a_long_text_is_cut_in_the_sentence() -> None:
    with pytest.raises(UserError) as caught:
        given_numbers(["x" * 1000], "a=1")
    assert len(str(caught.value)) < 130 and math.isfinite(given_numbers(["a=1"], "a=1")["a"])
