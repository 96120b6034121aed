"""A whole drive of a robot with a narrow view: what is found, and whether the check shows the true error."""

import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from chefbot.calibration.calibrate import CalibrationDrive, CalibrationResult, calibrate
from chefbot.calibration.drive import Square, Station
from chefbot.calibration.umbmark import return_errors
from chefbot.maths.se2 import SE2

sys.path.insert(0, str(Path(__file__).parent))
from drives import DRAWN, SENSOR, Built, Track
from rooms import CAMERA, LIDAR, WORKSHOP, seen

BUILT = Built(left=1.005, right=1.0155, separation=0.976, yaw=0.02, gyro_scale=0.986, gyro_offset=-0.01)
SIDE = 2.0


class Driven(NamedTuple):
    """The robot's path, and what was measured on it."""

    track: Track
    drive: CalibrationDrive


def square(track: Track, turn: int, slip: float = 0.0) -> Square:
    """The driver steers by the walls, so true sides and corners are as wanted; `slip` on the last side."""
    legs = []
    for side in range(4):
        legs.append(track.go(SIDE, 0.0, slip if side == 3 else 0.0))
        legs.append(track.go(0.0, turn * math.pi / 2))
    return Square(turn, SIDE, tuple(legs))


def homewards(track: Track, turn: int) -> None:
    """To the place and the heading at which a square that way begins, as the walls show."""
    target = SE2(0.0, 0.0, 0.0 if turn > 0 else math.pi / 2)
    for _ in range(2):
        step = track.pose.between(target)
        if math.hypot(step.x, step.y) > 0.03:
            track.go(0.0, math.atan2(step.y, step.x))
            track.go(math.hypot(step.x, step.y), 0.0)
        track.go(0.0, track.pose.between(target).yaw)


def driven(view: float, seed: int, drift: float, slip: float = 0.0) -> Driven:
    """One square each way to calibrate by and one to check it; `drift`: m and rad by which the stands' first poses
    wander. `slip`: m, on the last side of each check."""
    track, rng = Track(BUILT), np.random.default_rng(seed)
    for angle in (*[math.radians(29)] * 13, -2 * math.pi, 2 * math.pi):
        track.go(0.0, angle)
    squares = []
    for number, turn in enumerate((1, -1, 1, -1)):
        homewards(track, turn)
        squares.append(square(track, turn, slip if number > 1 else 0.0))
    wander = np.cumsum(rng.normal(size=(len(track.poses), 3)), axis=0) * drift / math.sqrt(len(track.poses))
    wander -= wander[0]  # the first stand is where the frame begins
    first, beams = track.poses[0], 120 if view == CAMERA else 240
    stands = [
        Station(SE2.of(first.between(pose).array() + off), seen(WORKSHOP, pose, rng, view, beams))
        for pose, off in zip(track.poses, wander, strict=True)
    ]
    return Driven(track, CalibrationDrive(stands, track.legs, squares[:2], squares[2:]))


def true_return(one: Driven, result: CalibrationResult) -> float:
    """E_max,syst of the check by where the robot really was."""
    checks = [check.between(one.track.poses) for check in one.drive.validation_squares]
    return return_errors(checks, result.solution.wheels, BUILT.sensor).worst


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.parametrize(("view", "seed"), [(CAMERA, 1), (LIDAR, 3)])
@pytest.mark.slow
def test_narrow_view_with_wrong_station_poses_still_calibrates(view: float, seed: int) -> None:
    """A camera sees one wall from many stands, and what it was thought to see them from wandered by 0.1 m and 6
    degrees. No wheel slipped; each that is reported as slipped is a stand that is not where it is thought to be."""
    one = driven(view, seed, 0.1)
    result = calibrate(one.drive, DRAWN, SENSOR)
    assert result.solution.wheels.factors(DRAWN) == pytest.approx(
        (BUILT.left, BUILT.right, BUILT.separation), rel=1e-3
    )
    assert not result.solution.slipped.any()
    assert not result.validation.slipped.any()
    first = one.track.poses[0]
    off = [
        pose.distance(first.between(truth))
        for pose, truth in zip(result.validation.poses, one.track.poses, strict=True)
    ]
    assert max(off) < 0.04
    assert result.after.worst < 0.05 * result.before.worst
    assert result.after.worst == pytest.approx(true_return(one, result), abs=0.015)


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_verification_reports_wheels_that_slipped() -> None:
    """The check's ticks help to find where it stood, and yet they cannot hide what they did."""
    one = driven(CAMERA, 4, 0.03, slip=0.01)
    result = calibrate(one.drive, DRAWN, SENSOR)
    truth = true_return(one, result)
    assert truth > 0.03
    assert result.after.worst == pytest.approx(truth, abs=0.005)
    assert result.validation.slipped.sum() == 2
