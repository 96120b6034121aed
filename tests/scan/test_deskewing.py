"""Scans of a lidar that turns while the robot moves, seen again as from one pose."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.maths.beams import beams_of
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.scan.deskewing import MAX_SWEEP, deskewed, knot_times, sweep_duration

HALF_X, HALF_Y, BEAMS, PERIOD = 3.0, 2.0, 360, 0.1
STEP = 2.0 * math.pi / BEAMS


def ranges_from(pose: SE2, bearings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Ranges to the walls of a room of 2 HALF_X by 2 HALF_Y."""
    directions = bearings + pose.yaw
    with np.errstate(divide="ignore"):
        to_x = (np.copysign(HALF_X, np.cos(directions)) - pose.x) / np.cos(directions)
        to_y = (np.copysign(HALF_Y, np.sin(directions)) - pose.y) / np.sin(directions)
    return np.minimum(to_x, to_y)


def moving(v: float, w: float, seconds: float) -> SE2:
    """Pose on an arc, from the origin at time 0."""
    if abs(w) < 1e-9:
        return SE2(v * seconds, 0.0, 0.0)
    turn = w * seconds
    return SE2(v / w * math.sin(turn), v / w * (1.0 - math.cos(turn)), turn)


def swept(v: float, w: float, increment: float) -> LaserScan:
    """A scan whose first beam is measured at the origin, at the stamp."""
    angles = -math.pi + STEP * np.arange(BEAMS)
    poses = [moving(v, w, i * increment) for i in range(BEAMS)]
    ranges = [float(ranges_from(pose, angles[i : i + 1])[0]) for i, pose in enumerate(poses)]
    times = increment, PERIOD
    stamp = Header.of(5_000_000_000, "laser")
    return LaserScan(stamp, -math.pi, math.pi - STEP, STEP, *times, 0.1, 12.0, np.array(ranges, np.float32))


def poses_of(scan: LaserScan, v: float, w: float) -> list[SE2]:
    return [moving(v, w, (time_ns - scan.header.stamp.ns) / 1e9) for time_ns in knot_times(scan)]


@pytest.mark.parametrize("increment", [PERIOD / BEAMS, -PERIOD / BEAMS])
@pytest.mark.parametrize(("v", "w"), [(0.35, 0.0), (0.0, 1.2), (0.3, -1.2)])
def test_the_walls_are_where_they_are_from_the_first_pose(v: float, w: float, increment: float) -> None:
    scan = swept(v, w, increment)
    true = ranges_from(SE2(0.0, 0.0, 0.0), scan.angles.astype(np.float64))
    found = deskewed(scan, poses_of(scan, v, w))
    seen = ~np.isnan(found.ranges)
    error = np.abs(found.ranges - true)[seen]
    assert seen.mean() > 0.97 and found.time_increment == 0.0
    skewed = float(np.abs(scan.ranges - true).max())
    # a beam is at most half a step off its direction: on a wall seen at 60 degrees, r times tan(60) times STEP / 2
    assert float(np.median(error)) < 0.01 and error.max() < 0.1
    assert skewed > 2.0 * float(np.quantile(error, 0.95))


def test_a_robot_that_stands_has_its_scan_unchanged() -> None:
    scan = swept(0.0, 0.0, -PERIOD / BEAMS)
    still = deskewed(scan, poses_of(scan, 0.0, 0.0))
    assert still.time_increment == 0.0 and (still.ranges == scan.ranges).all()


def test_no_beam_looked_into_the_gap_that_the_turn_leaves() -> None:
    """Turning against the lidar's sense, the robot misses the angle by which it has turned."""
    scan = swept(0.0, 1.2, -PERIOD / BEAMS)
    found = deskewed(scan, poses_of(scan, 0.0, 1.2))
    with_the_lidar = deskewed(swept(0.0, -1.2, -PERIOD / BEAMS), poses_of(scan, 0.0, -1.2))
    missing = [int(np.isnan(one.ranges).sum()) for one in (found, with_the_lidar)]
    assert sorted(missing)[0] == 0 and 4 <= sorted(missing)[1] <= 8


def test_directions_without_a_return_stay_so() -> None:
    scan = swept(0.0, 1.2, -PERIOD / BEAMS)
    ranges = scan.ranges.copy()
    ranges[100:140] = np.inf
    found = deskewed(msgspec.structs.replace(scan, ranges=ranges), poses_of(scan, 0.0, 1.2))
    assert 37 <= np.isinf(found.ranges).sum() <= 43


def test_a_wrong_time_increment_counts_as_none() -> None:
    scan = swept(0.0, 0.0, 0.0)
    assert sweep_duration(scan) == 0.0 and len(knot_times(scan)) == 1
    wrong = msgspec.structs.replace(scan, time_increment=2.0 * MAX_SWEEP / BEAMS)
    assert sweep_duration(wrong) == 0.0


def test_beams_take_the_shortest_of_their_samples() -> None:
    bearings = np.array([0.0, 0.02, 0.9, 1.0, 2.0])
    ranges = np.array([2.0, 1.0, 3.0, np.nan, np.inf])
    found = beams_of(bearings, ranges, 0.0, 1.0, 4)
    assert found[:3].tolist() == [1.0, 3.0, np.inf] and np.isnan(found[3])
    backwards = beams_of(-bearings, ranges, 0.0, -1.0, 4)
    assert backwards[:3].tolist() == found[:3].tolist()
    assert np.isnan(beams_of(bearings[:0], ranges[:0], 0.0, 1.0, 3)).all()
