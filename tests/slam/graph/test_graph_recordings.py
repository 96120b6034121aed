"""Tests graph SLAM on public recordings; truth is known for the simulated one, and for pairs of scans of Intel."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.slam import GraphSlam, GraphSlamParams, run_log
from chefbot.slam.carmen import parse
from chefbot.slam.relations import parse_relations, relation_errors, track_of_log

pytestmark = [pytest.mark.slow, pytest.mark.data]


def ate(found, true) -> float:
    """Return the root mean square position error after alignment (Umeyama 1991), m."""
    a, b = found - found.mean(axis=0), true - true.mean(axis=0)
    z = np.vdot(a[:, 0] + 1j * a[:, 1], b[:, 0] + 1j * b[:, 1])
    turned = (a[:, 0] + 1j * a[:, 1]) * z / abs(z)
    return float(np.sqrt(np.mean(np.abs(turned - (b[:, 0] + 1j * b[:, 1])) ** 2)))


@pytest.mark.rotated("recordings")
def test_intel_relations_between_scans(shared) -> None:
    records = list(parse(gzip.decompress(shared("data/slam/intel_full.log.gz").read_bytes()).decode()))
    result = run_log(records, GraphSlamParams())
    track = track_of_log(records, result.stamps, result.poses)
    exact = parse_relations(shared("data/slam/intel_exact.relations").read_text())
    assert relation_errors(track, exact).mean() < 0.020
    relations = parse_relations(shared("data/slam/intel.relations").read_text())
    assert relation_errors(track, relations).mean() < 0.056, "odometry between the scans is in it"


@pytest.mark.rotated("recordings")
def test_loops_close_with_odometry_40_m_off(shared) -> None:
    z = np.load(shared("data/slam/simul.npz"))
    slam = GraphSlam(GraphSlamParams(), SE2.of(z["sensor_pose"]))
    angles = (z["angle_min"] + np.arange(z["ranges"].shape[1]) * z["angle_increment"]).astype(np.float32)
    ranges = np.where(z["valid"].astype(bool), z["ranges"], np.inf).astype(np.float32)
    used = [slam.update(angles, r, SE2.of(o)) for r, o in zip(ranges, z["odom"], strict=True)]
    slam.finish()
    assert ate(np.array(slam.trajectory())[:, :2], z["truth"][used][:, :2]) < 0.04
