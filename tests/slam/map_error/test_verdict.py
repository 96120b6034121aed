"""The estimated error of a map in words and as a grid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.grid import UNKNOWN
from chefbot.slam.map_error.error_grid import MAX_VALUE, error_grid
from chefbot.slam.map_error.estimate import REGION, MapErrorEstimate, MapRegion
from chefbot.slam.map_error.verdict import MAX_GOOD_ERROR, MAX_USABLE_ERROR, centimetres, verdict

CELLS = st.dictionaries(
    st.tuples(st.integers(-20, 20), st.integers(-20, 20)), st.floats(0.0, 3.0), min_size=1
)


def estimate_of(drift: float, contradiction: float) -> MapErrorEstimate:
    return MapErrorEstimate(drift, contradiction, 0.5, [MapRegion(0.0, 0.0, drift, contradiction)])


@pytest.mark.parametrize(
    ("error", "word"),
    [
        (MAX_GOOD_ERROR, "good"),
        (1.01 * MAX_GOOD_ERROR, "usable"),
        (MAX_USABLE_ERROR, "usable"),
        (1.01 * MAX_USABLE_ERROR, "bad"),
    ],
)
def test_the_verdict_follows_the_error(error: float, word: str) -> None:
    assert f"The map is {word}: its estimated error is {centimetres(error)}." in verdict(
        estimate_of(0.0, error)
    )


def test_large_errors_are_in_metres() -> None:
    assert (centimetres(0.234), centimetres(2.34)) == ("23 cm", "2.3 m")


@given(CELLS)
def test_the_grid_has_each_error_at_its_place(errors: dict[tuple[int, int], float]) -> None:
    regions = [MapRegion(REGION * x, REGION * y, error, 0.0) for (x, y), error in errors.items()]
    grid = error_grid(MapErrorEstimate(0.0, 0.0, 1.0, regions))
    for region in regions:
        assert grid.at(*region.centre) == min(round(100 * region.error), MAX_VALUE)
    assert np.count_nonzero(grid.cells != UNKNOWN) == len(regions)
