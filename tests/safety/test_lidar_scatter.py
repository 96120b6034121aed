"""A lidar whose ranges scatter is distinguished from one that sees edges."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from chefbot.safety.obstacle_sensors import QUARTILE_RATIO, scatters

ANGLES = np.linspace(-np.pi, np.pi, 360, endpoint=False)
ROOM = 2.5 / np.maximum(np.abs(np.cos(ANGLES)), np.abs(np.sin(ANGLES)))
NOISE = 0.01


def with_legs(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Return the ranges of a room with legs of chairs, two beams each."""
    ranges = ROOM.copy()
    for k in rng.integers(0, 358, count):
        ranges[k : k + 2] = rng.uniform(0.4, 2.0)
    return ranges


@pytest.mark.parametrize("seed", range(1, 20, 2))
def test_furniture_is_not_scatter_but_a_damaged_lidar_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for legs in (0, 10, 25, 60, 80):  # with 60 legs half of the differences are edges
        clean = with_legs(rng, legs) + NOISE * rng.standard_normal(360)
        assert not scatters(clean.astype(np.float32), NOISE)
        assert not scatters(np.where(rng.random(360) < 0.2, np.inf, clean).astype(np.float32), NOISE)
        for share in (0.1, 0.3):
            damaged = clean * (1.0 + share * rng.standard_normal(360))
            assert scatters(damaged.astype(np.float32), NOISE)


@pytest.mark.parametrize("missing", [0.0, -1.0, np.nan, np.inf])
def test_dropouts_are_not_scatter(missing: float) -> None:
    """Whatever number a lidar sends for them, and although most ranges have one beside them."""
    rng = np.random.default_rng(5)
    clean = ROOM + NOISE * rng.standard_normal(360)
    for dropouts in (rng.random(360) < 0.55, np.arange(360) % 5 >= 3):
        assert not scatters(np.where(dropouts, missing, clean).astype(np.float32), NOISE)


def test_the_ratio_of_quartiles_is_that_of_normal_noise() -> None:
    assert pytest.approx(norm.ppf(0.625) / norm.ppf(0.75), abs=1e-3) == QUARTILE_RATIO


def test_too_few_ranges_decide_nothing() -> None:
    assert not scatters(np.full(360, np.inf, np.float32), NOISE)
    assert not scatters(np.full(360, np.nan, np.float32), NOISE)
    assert not scatters(np.zeros(2, np.float32), NOISE)
    assert not scatters(np.full(360, 3e38, np.float32), NOISE)


def zigzag(amplitude: float, count: int = 360, distance: float = 1.0) -> NDArray[np.float32]:
    """Return ranges that go up and down: their second difference is four times the amplitude everywhere."""
    return (distance + amplitude * (-1.0) ** np.arange(count)).astype(np.float32)


@pytest.mark.parametrize(("noise", "distance"), [(0.0, 1.0), (0.01, 1.0), (0.01, 4.0)])
def test_limit_is_five_times_noise_and_a_fiftieth_of_the_range(noise: float, distance: float) -> None:
    limit = QUARTILE_RATIO * (5.0 * 6.0**0.5 * noise + 0.02 * distance) / 4.0
    assert scatters(zigzag(1.03 * limit, distance=distance), noise)
    assert not scatters(zigzag(0.97 * limit, distance=distance), noise)


@pytest.mark.parametrize(("count", "judged"), [(31, False), (32, True)])
def test_thirty_ranges_between_two_others_are_judged(count: int, judged: bool) -> None:
    assert scatters(zigzag(0.3, count), NOISE) == judged
    gaps = zigzag(0.3, 360)
    gaps[count:] = np.nan
    assert scatters(gaps, NOISE) == judged


def test_a_straight_wall_does_not_scatter_however_steep() -> None:
    assert not scatters(np.linspace(0.2, 8.0, 360).astype(np.float32), 0.0)
