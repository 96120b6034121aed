"""Tests that the values which the laser of a log writes for beams without return are detected, and no others."""

from __future__ import annotations

import gzip
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.slam import GmappingParams, run_log
from chefbot.slam.carmen import beam_angles, parse
from chefbot.slam.no_return import detect_no_return
from chefbot.slam.recorded_scan import RecordedScan

from .conftest import CORRIDOR, World

ANGLES = beam_angles(180)
HALL = World.of([[(0, 0), (40, 0), (40, 25), (0, 25)], [(10, 8), (12, 8), (12, 12), (10, 12)]])
CROSSING = [SE2(2.0 + 0.3 * i, 6.0 + 2.0 * math.sin(i), 0.4 * math.sin(i / 3)) for i in range(60)]
STANDING = [SE2(5.0, 5.0, 0.0)] * 60


def recorded(
    world: World, poses: list[SE2], reach: float, nothing: list[float], seed: int = 0
) -> list[RecordedScan]:
    """Return the scans of a drive with 1 cm noise; beams beyond `reach` metres have one of the values `nothing`."""
    rng = np.random.default_rng(seed)
    scans = []
    for i, pose in enumerate(poses):
        ranges = world.ranges(pose, ANGLES, reach)
        measured = np.round(ranges + rng.normal(0.0, 0.01, len(ranges)), 2)
        values = np.where(np.isfinite(ranges), measured, rng.choice(nothing, len(ranges)))
        scans.append(RecordedScan(float(i), ANGLES, values.astype(np.float32), pose, pose))
    return scans


@pytest.mark.parametrize(
    ("reach", "nothing", "lowest"),
    [
        (25.0, [81.91], 81.91),  # far above all measured ranges
        (25.0, [51.1, 51.15, 51.15, 51.15, 51.25, 50.0], 50.0),  # a band of values
        (8.0, [8.19], 8.19),  # just above the measured ranges
        (8.0, [8.0], 8.0),  # the maximum range of the sensor
        (20.0, [327.67], 327.67),
        (20.0, [32.0, 81.83], 32.0),  # two values far from each other
        (20.0, [1e29], float(np.float32(1e29))),  # as the log's ranges are kept
        (20.0, [32.0, 1e6], 32.0),
    ],
)
def test_values_shared_by_many_beams_at_the_top_are_no_returns(
    reach: float, nothing: list[float], lowest: float
) -> None:
    scans = recorded(HALL, CROSSING, reach, nothing)
    found = detect_no_return(scans)
    assert found is not None
    assert lowest * 0.995 <= found.min_range <= lowest + 1e-3
    values = np.concatenate([scan.ranges for scan in scans])
    assert found.share == pytest.approx(np.mean(values >= found.min_range))


@pytest.mark.parametrize("world", [HALL, World.of(CORRIDOR)], ids=["hall", "corridor"])
@pytest.mark.parametrize("poses", [CROSSING, STANDING], ids=["drives", "stands"])
def test_far_walls_are_not_taken_for_no_return(world: World, poses: list[SE2]) -> None:
    """The robot drives in a hall and in a long corridor, or stands and measures the same ranges again."""
    inside = [SE2(p.x - 25.0, 0.1 * p.y - 0.5, p.yaw) if world is not HALL else p for p in poses]
    assert detect_no_return(recorded(world, inside, 200.0, [200.0])) is None


def test_a_single_glass_door_is_not_a_no_return_value() -> None:
    """A value of a few beams in one scan is a measurement."""
    scans = recorded(HALL, CROSSING, 100.0, [100.0])
    scans[7] = replace(
        scans[7], ranges=np.where(np.arange(180) < 5, 80.0, scans[7].ranges).astype(np.float32)
    )
    assert detect_no_return(scans) is None


def test_no_wall_is_drawn_for_no_return_beams() -> None:
    """This holds below max_range too, and obstacles within the range are still mapped."""
    result = run_log(recorded(HALL, CROSSING[:20], 12.0, [51.15]), GmappingParams(particles=2))
    assert result.no_return is not None and result.no_return.min_range == pytest.approx(51.15, abs=0.01)
    occupied = np.argwhere(result.grid.cells >= 65)
    far = max(result.grid.width, result.grid.height) * result.grid.resolution
    assert len(occupied) > 300 and far < 40.0


LOGS = {
    "fhw": (51.05, 0.007), "intel": (81.83, 0.025), "csail": (81.91, 0.027), "fr101": (81.83, 0.119),
    "seattle": (81.87, 0.008), "edmonton": (51.09, 0.055), "acapulco": (50.0, 0.085), "fr_campus": (81.83, 0.259),
}  # fmt: skip
"""By log the lowest value for no return and its share; the rule was developed with fhw and intel."""


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize("log", LOGS)
def test_no_return_values_of_public_recordings_are_found(log: str, shared: Callable[[str], Path]) -> None:
    text = gzip.decompress(shared(f"data/slam/{log}.log.gz").read_bytes()).decode()
    scans = [record for record in parse(text) if isinstance(record, RecordedScan)]
    found = detect_no_return(scans)
    assert found is not None
    assert found.min_range == pytest.approx(LOGS[log][0], rel=0.003)
    assert found.share == pytest.approx(LOGS[log][1], abs=0.001)
    without_far = [
        replace(s, ranges=np.where(s.ranges >= found.min_range, 0, s.ranges).astype(np.float32))
        for s in scans
    ]
    assert detect_no_return(without_far) is None
    for begin in range(0, len(without_far) - 20, 20):  # in a short part equal ranges are more frequent
        assert detect_no_return(without_far[begin : begin + 20]) is None
