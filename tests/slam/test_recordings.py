"""Tests mapping of public recordings against the accuracy that is published for gmapping or was measured with it."""

from __future__ import annotations

import gzip
from typing import Any

import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.slam import Gmapping, GmappingParams, run_log
from chefbot.slam.carmen import parse
from chefbot.slam.recorded_scan import RecordedScan

pytestmark = [pytest.mark.slow, pytest.mark.data]


def seeds(few: int, many: int) -> list[Any]:
    """Return seeds from 1 to `many`; those above `few` are marked long."""
    return [pytest.param(seed, marks=pytest.mark.long if seed > few else ()) for seed in range(1, many + 1)]


def read(path):
    return list(parse(gzip.decompress(path.read_bytes()).decode()))


def compose(a, b):
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    x, y = a[:, 0] + c * b[:, 0] - s * b[:, 1], a[:, 1] + s * b[:, 0] + c * b[:, 1]
    return np.column_stack([x, y, a[:, 2] + b[:, 2]])


def inverse(a):
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    return np.column_stack([-c * a[:, 0] - s * a[:, 1], s * a[:, 0] - c * a[:, 1], -a[:, 2]])


def interpolated_track(records, stamps, poses):
    """Return rows (t, x, y, yaw) for all records: the pose of the last processed scan and the odometry since."""
    processed, rows, base, origin = dict(zip(stamps, poses, strict=True)), [], None, None
    for r in records:
        if isinstance(r, RecordedScan) and r.stamp in processed:
            base, origin = processed[r.stamp], r.odom
        if base is not None:
            rows.append([r.stamp, *(base @ origin.between(r.odom))])
    rows.sort(key=lambda row: row[0])
    return np.array(rows)


def relation_errors(track, relations):
    """Return the errors of relative positions in metres, shape (n,) (Kuemmerle et al. 2009)."""
    t, first = np.unique(track[:, 0], return_index=True)
    xy, yaw = track[first, 1:3], np.unwrap(track[first, 3])

    def at(s):
        return np.column_stack([np.interp(s, t, xy[:, 0]), np.interp(s, t, xy[:, 1]), np.interp(s, t, yaw)])

    found = compose(inverse(at(relations[:, 0])), at(relations[:, 1]))
    return np.hypot(*(found[:, :2] - relations[:, 2:4]).T)


def ate(found, true):
    """Return the absolute trajectory error: root mean square after alignment (Umeyama 1991), metres."""
    a, b = found - found.mean(axis=0), true - true.mean(axis=0)
    z = np.vdot(a[:, 0] + 1j * a[:, 1], b[:, 0] + 1j * b[:, 1])
    turned = (a[:, 0] + 1j * a[:, 1]) * z / abs(z)
    return float(np.sqrt(np.mean(np.abs(turned - (b[:, 0] + 1j * b[:, 1])) ** 2)))


@pytest.mark.rotated("recordings")
@pytest.mark.parametrize("seed", seeds(2, 5))
def test_intel_accuracy_matches_published_gmapping(shared, seed: int) -> None:
    records = read(shared("data/slam/intel_full.log.gz"))
    result = run_log(records, GmappingParams(seed=seed))
    relations = np.loadtxt(shared("data/slam/intel.relations"))
    errors = relation_errors(interpolated_track(records, result.stamps, result.poses), relations)
    assert len(errors) == 2984
    assert errors.mean() < 0.070


@pytest.mark.rotated("recordings")
@pytest.mark.parametrize("seed", seeds(1, 3))
def test_csail_agrees_with_the_reference(shared, seed: int) -> None:
    result = run_log(read(shared("data/slam/csail.log.gz")), GmappingParams(seed=seed))
    reference = np.loadtxt(shared("data/slam/csail_reference.tum"))
    near = np.abs(reference[:, 0] - np.array(result.stamps)[:, None]).argmin(axis=1)
    assert np.abs(reference[near, 0] - result.stamps).max() < 0.05
    assert ate(np.array(result.poses)[:, :2], reference[near, 1:3]) < 0.20


@pytest.mark.rotated("recordings")
@pytest.mark.parametrize("seed", seeds(1, 3))
def test_loops_close_with_odometry_40_m_off(shared, seed: int) -> None:
    z = np.load(shared("data/slam/simul.npz"))
    slam = Gmapping(GmappingParams(seed=seed), SE2.of(z["sensor_pose"]))
    angles = (z["angle_min"] + np.arange(z["ranges"].shape[1]) * z["angle_increment"]).astype(np.float32)
    ranges = np.where(z["valid"].astype(bool), z["ranges"], np.inf).astype(np.float32)
    used = [slam.update(angles, r, SE2.of(o)) for r, o in zip(ranges, z["odom"], strict=True)]
    assert ate(np.array(slam.trajectory())[:, :2], z["truth"][used][:, :2]) < 0.10
