"""Tests the tiles shared by particles against a dictionary for each particle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.slam.cell_bounds import MapSizeError
from chefbot.slam.matching import score
from chefbot.slam.shared_tiles import EMPTY, SHIFT, SIDE, STRIDE, TileMaps


def create_maps(particles: int, reach: float = 60.0) -> TileMaps:
    maps = TileMaps(particles, 10_000_000)
    maps.grow_to(np.array([-reach, -reach]), np.array([reach, reach]))
    return maps


def add(maps: TileMaps, particle: int, points: np.ndarray) -> None:
    maps.add(particle, (points - maps.corner).astype(np.float32))


def mean(maps: TileMaps, particle: int, column: int, row: int) -> tuple[float, float, int] | None:
    """Return mean x, mean y and hits of a cell in the map frame; None without a hit."""
    x, y = int(column - maps.corner[0]), int(row - maps.corner[1])
    tile = maps.table[particle, y >> SHIFT, x >> SHIFT]
    cell = (y % SIDE + 1) * STRIDE + x % SIDE + 1
    if tile == EMPTY or maps.hits[tile, cell] == 0:
        return None
    left, low = (x >> SHIFT) * SIDE + maps.corner[0], (y >> SHIFT) * SIDE + maps.corner[1]
    hits = int(maps.hits[tile, cell])
    return float(maps.mean_x[tile, cell] + left), float(maps.mean_y[tile, cell] + low), hits


def plain_means(points: list[np.ndarray]) -> dict[tuple[int, int], np.ndarray]:
    cells: dict[tuple[int, int], list[np.ndarray]] = {}
    for p in np.vstack(points):
        cells.setdefault((int(np.floor(p[0])), int(np.floor(p[1]))), []).append(p)
    return {c: np.mean(v, axis=0) for c, v in cells.items()}


@settings(max_examples=25)
@given(st.integers(0, 10_000))
@pytest.mark.slow
def test_every_particle_has_its_own_hits_only(seed: int) -> None:
    rng = np.random.default_rng(seed)
    maps, histories = create_maps(4), [[] for _ in range(4)]
    for _ in range(6):
        for i in range(4):
            points = rng.uniform(-40, 40, (30, 2)).round(2) + 0.005
            add(maps, i, points)
            histories[i].append(points)
        parents = rng.integers(0, 4, 4)
        maps.resample(parents)
        histories = [list(histories[j]) for j in parents]
    for i, history in enumerate(histories):
        expected = plain_means(history)
        for column in range(-41, 41, 1):
            for row in range(-41, 41, 4):
                got, want = mean(maps, i, column, row), expected.get((column, row))
                assert (got is None) == (want is None)
                if got is not None:
                    assert got[:2] == pytest.approx(want, abs=1e-3)


@settings(max_examples=25)
@given(st.integers(0, 10_000))
@pytest.mark.slow
def test_the_nearest_surface_is_found_across_tile_borders(seed: int) -> None:
    rng = np.random.default_rng(seed)
    maps = create_maps(1)
    points = rng.uniform(-20, 20, (300, 2)).round(2) + 0.005
    add(maps, 0, points)
    means = plain_means([points])
    for beam in rng.uniform(-20, 20, (50, 2)):
        cell = np.floor(beam)
        near = [np.sum((m - beam) ** 2) for c, m in means.items() if np.abs(np.array(c) - cell).max() <= 1]
        expected = max(0.0, 1 - min(near, default=np.inf) / 8) ** 8
        x, y = beam - maps.corner
        origin = np.zeros((1, 2), np.float32)
        got = score(origin, x, y, 0.0, np.float32(1), maps.table[0], maps.mean_x, maps.mean_y)
        assert got == pytest.approx(expected, abs=2e-3)


def test_particles_share_common_tiles() -> None:
    maps, rng = create_maps(30), np.random.default_rng(1)
    common = rng.uniform(-50, 50, (2000, 2))
    add(maps, 0, common)
    alone = maps.tiles_in_use
    maps.resample(np.zeros(30, np.int64))
    assert maps.tiles_in_use == alone
    for i in range(30):
        add(maps, i, np.array([[3.5, 3.5]]))
    assert maps.tiles_in_use == alone + 29
    maps.resample(np.full(30, 7))
    assert maps.tiles_in_use == alone


def test_growing_the_map_moves_no_hit() -> None:
    maps = create_maps(2, 5.0)
    add(maps, 1, np.array([[2.25, -3.75]]))
    before = mean(maps, 1, 2, -4)
    for reach in (100.0, 900.0):
        maps.grow_to(np.array([-reach, -3.0]), np.array([5.0, reach]))
        assert mean(maps, 1, 2, -4) == before == (2.25, -3.75, 1)
        assert mean(maps, 0, 2, -4) is None


@pytest.mark.parametrize("far", [1e4, 1e12, np.inf, np.nan])
def test_an_implausible_extent_is_rejected(far: float) -> None:
    maps = create_maps(1)
    with pytest.raises(MapSizeError, match="check odometry and scans"):
        maps.grow_to(np.zeros(2), np.array([far, far]))
