"""Which neighbouring points of a scan may be reflections of glass."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.reflections import MAX_DISTANCE, find_reflections

NAN, INF = math.nan, math.inf


def found(*ranges: float) -> list[tuple[int, int]]:
    """Return first and last + 1 of the reflections in beams that are 2 degrees apart."""
    angles = np.radians(2.0) * np.arange(len(ranges))
    return [(first, end) for first, end in find_reflections(angles, np.array(ranges)).tolist()]


@pytest.mark.parametrize("behind", [1.4, 5.0, INF])
def test_a_few_points_before_free_space_are_found(behind: float) -> None:
    assert found(behind, behind, 1.0, 1.01, 1.0, behind) == [(2, 5)]


@pytest.mark.parametrize(
    "ranges",
    [
        (4.0, 1.0, 1.0, 4.0),  # too few
        (1.2, 1.0, 1.0, 1.0, 4.0),  # something beside it
        (4.0, 1.0, 1.0, 1.0, 0.5, 4.0),
        (4.0, *[1.0] * 20, 4.0),  # too wide
        (1.0, 1.0, 1.0, 4.0),  # at the first beam
        (4.0, 1.0, 1.0, 1.0),  # at the last one
        (9.0, *[MAX_DISTANCE + 0.1] * 4, 9.0),
        (4.0, NAN, NAN, NAN, 1.0, 1.0, 1.0, 4.0),  # unknown beside it
        (4.0, 1.0, 1.0, 1.0, NAN, NAN, NAN, 4.0),
        (INF, INF, INF, INF, INF),
        (NAN, NAN, NAN, NAN),
        (),
    ],
)
def test_all_else_is_not(ranges: tuple[float, ...]) -> None:
    assert found(*ranges) == []


def test_invalid_beams_between_the_points_are_passed_over() -> None:
    assert found(4.0, NAN, 1.0, NAN, 1.0, NAN, NAN, 1.0, NAN, 4.0) == [(2, 8)]


@given(st.lists(st.sampled_from([0.5, 0.55, 1.0, 1.05, 2.0, 5.0, INF, NAN]), max_size=60))
def test_what_is_found_has_points_and_free_space_on_both_sides(ranges: list[float]) -> None:
    end_before = 0
    for first, end in found(*ranges):
        assert end_before <= first < end < len(ranges)
        inside = [r for r in ranges[first:end] if not math.isnan(r)]
        beside = next(r for r in ranges[end:] if not math.isnan(r))
        assert len(inside) >= 3 and max(inside) <= MAX_DISTANCE and beside >= max(inside) + 0.3
        end_before = end
