"""The polar views of keyframes have each range at its bearing."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.slam.map_error.keyframes import BINS, polar_view

ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False).astype(np.float32)


@given(st.floats(-math.pi, math.pi), st.integers(3, 300), st.floats(0.3, 6.2))
def test_a_view_has_each_beam_at_its_bearing(first: float, beams: int, extent: float) -> None:
    angles = (first + np.linspace(0.0, extent, beams)).astype(np.float32)
    ranges = np.arange(1, beams + 1, dtype=np.float32)
    view = polar_view(angles, ranges)
    centres = (np.arange(BINS) + 0.5) * 2 * math.pi / BINS - math.pi
    spacing = extent / (beams - 1)
    for value, centre in zip(view, centres, strict=True):
        away = np.abs(np.angle(np.exp(1j * (angles - centre))))
        if math.isnan(value):
            assert away.min() > math.pi / BINS - 1e-5
        else:
            assert away[int(value) - 1] <= max(0.75 * spacing, math.pi / BINS) + 1e-5


def test_nothing_is_known_of_an_empty_view() -> None:
    assert np.isnan(polar_view(ANGLES, np.full(len(ANGLES), np.nan, np.float32))).all()
