"""Tests localization on recordings: the even scans at their reference poses give the map, the odd ones are localized.

The reference poses come from another SLAM and are good to some 6 cm; the raw odometry is that of old robots.
"""

from __future__ import annotations

import gzip
import itertools
import math
import os
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom

from chefbot.localization.amcl import Amcl
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import Grid
from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import SE2

SHARED = Path(os.environ.get("CHEFBOT_SHARED", Path(__file__).parents[2].parent / "shared")) / "data/slam"
RANGE = 30.0
CELL = 0.05
POOR_ODOMETRY = AmclParams(
    odometry_noise=OdometryNoise(
        rotation_from_rotation=0.2,
        rotation_from_translation=0.1,
        translation_from_translation=0.2,
        translation_from_rotation=0.1,
    ),
)
pytestmark = [pytest.mark.slow, pytest.mark.data]


class Recording(NamedTuple):
    """angles (m,), ranges (n, m), odometry and reference poses (n, 3), and the map from the even scans."""

    angles: NDArray[np.float64]
    ranges: NDArray[np.float64]
    odometry: NDArray[np.float64]
    reference: NDArray[np.float64]
    grid: Grid


@pytest.fixture(scope="module", params=["intel", "csail"])
def recording(request: pytest.FixtureRequest) -> Recording:
    path = SHARED / f"{request.param}.log.gz"
    if not path.exists():
        pytest.skip(f"{path} is absent: set CHEFBOT_SHARED to the folder of shared data")
    with gzip.open(path, "rt") as file:
        fields = [line.split() for line in file if line.startswith("FLASER")]
    n = int(fields[0][1])
    ranges = np.array([f[2 : 2 + n] for f in fields], np.float64)
    odometry = np.array([f[5 + n : 8 + n] for f in fields], np.float64)
    tum = np.loadtxt(SHARED / f"{request.param}_reference.tum")
    reference = np.column_stack([tum[:, 1], tum[:, 2], 2.0 * np.arctan2(tum[:, 6], tum[:, 7])])
    angles = np.deg2rad(-90.0 + np.arange(n) * (1.0 if n < 200 else 0.5))
    ranges[ranges >= RANGE] = np.inf
    return Recording(angles, ranges, odometry, reference, draw(angles, ranges[::2], reference[::2]))


def draw(angles: NDArray[np.float64], ranges: NDArray[np.float64], poses: NDArray[np.float64]) -> Grid:
    """Return the grid in which cells are occupied if more than a quarter of the beams through them end there."""
    low = poses[:, :2].min(axis=0) - RANGE
    size = np.ceil((poses[:, :2].max(axis=0) + RANGE - low) / CELL).astype(int)
    hits, seen = np.zeros(size[::-1]), np.zeros(size[::-1])
    for scan, (x, y, yaw) in zip(ranges, poses, strict=True):
        met = np.isfinite(scan)
        steps = np.arange(0.0, 1.0 - 1e-9, CELL / RANGE)
        reach = np.minimum(steps[None, :] * RANGE, scan[met, None])
        inside = steps[None, :] * RANGE < scan[met, None]
        c, s = np.cos(yaw + angles[met])[:, None], np.sin(yaw + angles[met])[:, None]
        cols = ((x + reach * c - low[0]) / CELL).astype(int)
        rows = ((y + reach * s - low[1]) / CELL).astype(int)
        np.add.at(seen, (rows[inside], cols[inside]), 1)
        ends = (
            ((y + scan[met] * s[:, 0] - low[1]) / CELL).astype(int),
            ((x + scan[met] * c[:, 0] - low[0]) / CELL).astype(int),
        )
        np.add.at(seen, ends, 1)
        np.add.at(hits, ends, 1)
    cells = np.where(seen == 0, -1, np.where(hits > 0.25 * seen, 100, 0)).astype(np.int8)
    return Grid(cells, CELL, float(low[0]), float(low[1]))


def localize(amcl: Amcl, r: Recording, scans: range) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the distance to the reference and whether the filter has converged after each scan."""
    errors, converged = [], []
    for k in scans:
        amcl.update(r.angles, r.ranges[k], RANGE, SE2.of(r.odometry[k]))
        errors.append(amcl.pose.distance(SE2.of(r.reference[k])))
        converged.append(amcl.converged)
    return np.array(errors), np.array(converged)


@pytest.mark.rotated("recordings")
def test_odd_scans_are_tracked_on_the_map_of_even_scans(recording: Recording) -> None:
    amcl = Amcl(POOR_ODOMETRY, recording.grid, SE2(0.0, 0.0, 0.0))
    amcl.set_pose(SE2.of(recording.reference[1]), 0.2, 0.1)
    errors, converged = localize(amcl, recording, range(1, len(recording.ranges), 2))
    ate = math.sqrt(float(np.mean(errors**2)))

    assert ate < 0.06 and errors.max() < 0.4
    assert converged[5:].mean() > 0.95


AMBIGUOUS_SHARE = 0.1
"""Share of starts that are ambiguous for longer, such as scan 95 of csail in a corridor with every seed tried."""


@pytest.mark.rotated("recordings")
@pytest.mark.parametrize("rounds", [1, pytest.param(10, marks=pytest.mark.long)])
def test_global_localization_succeeds_from_any_start(recording: Recording, rounds: int) -> None:
    """It is correct after 21 scans, and never converges to a wrong place.

    The number of later starts is within the 99.9 % quantile of a binomial distribution with AMBIGUOUS_SHARE.
    """
    starts = np.linspace(1, len(recording.ranges) - 60, 12).astype(int) // 2 * 2 + 1
    late = []
    for seed, start in itertools.product(range(rounds), map(int, starts)):
        params = msgspec.structs.replace(POOR_ODOMETRY, seed=1000 * seed + start)
        amcl = Amcl(params, recording.grid, SE2(0.0, 0.0, 0.0))
        errors, converged = localize(amcl, recording, range(start, start + 50, 2))
        assert not (converged & (errors > 0.5)).any(), f"from scan {start}, seed {params.seed}"
        if errors[-5:].max() >= 0.4 or not converged[-1]:
            late.append((start, params.seed))
    assert len(late) <= binom.ppf(0.999, 12 * rounds, AMBIGUOUS_SHARE), late
