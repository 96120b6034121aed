"""Tests mapping of complete recordings."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.carmen import CarmenLogError
from chefbot.slam.offline import SlamResult, run_log, trajectory_tum
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedOdometry, RecordedScan

ANGLES = np.linspace(-1.5, 1.5, 60).astype(np.float32)


def scan(stamp: float, x: float) -> RecordedScan:
    """A scan in front of a flat wall at x = 3 m."""
    pose = SE2(x, 0.0, 0.0)
    return RecordedScan(stamp, ANGLES, ((3.0 - x) / np.cos(ANGLES)).astype(np.float32), pose, pose)


def test_processed_scans_have_stamped_poses() -> None:
    records = [RecordedOdometry(0.0, SE2(0.0, 0.0, 0.0)), *(scan(k, 0.6 * k) for k in range(4))]
    calls: list[tuple[int, int]] = []
    result = run_log(records, GmappingParams(particles=2), lambda *call: calls.append(call))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert result.scans == 4 and len(result.stamps) == len(result.poses) >= 2
    assert result.stamps == sorted(result.stamps)
    assert result.grid.at(0.0, 0.0) < 25, "the driven path is free"


def test_a_recording_without_scans_is_rejected() -> None:
    with pytest.raises(CarmenLogError, match="FLASER"):
        run_log([RecordedOdometry(0.0, SE2(0.0, 0.0, 0.0))], GmappingParams())


def test_tum_lines_have_unit_quaternions() -> None:
    grid = Grid(np.zeros((1, 1), np.int8), 0.05, 0.0, 0.0)
    result = SlamResult([1.0, 2.5], [SE2(1.0, 2.0, 0.5), SE2(0.0, -1.0, 3.0)], grid, 2, None, [])
    rows = np.array([line.split() for line in trajectory_tum(result).splitlines()], float)
    assert rows[:, 0].tolist() == [1.0, 2.5]
    assert np.hypot(rows[:, 6], rows[:, 7]) == pytest.approx([1.0, 1.0])
    assert 2.0 * np.arctan2(rows[:, 6], rows[:, 7]) == pytest.approx([0.5, 3.0])
