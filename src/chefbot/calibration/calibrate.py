"""Calibration of a robot from a measured drive, with a validation on separate squares."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from chefbot.calibration.alignment import MIN_COMMON_POINTS, ScanMatch, link_stations
from chefbot.calibration.drive import DriveSegment, Square, Station
from chefbot.calibration.errors import CalibrationError
from chefbot.calibration.gyro import GyroSolution, solve_gyro
from chefbot.calibration.solve import Solution, solve
from chefbot.calibration.surface import Surface
from chefbot.calibration.umbmark import ReturnErrors, Umbmark, return_errors, umbmark
from chefbot.calibration.wheels import WheelParams
from chefbot.maths.se2 import SE2

ROUNDS = 4
"""Maximum rounds of matching and solving; better station poses give more matches between their scans."""
CONVERGENCE_CHANGE = 2e-5
"""Change of the wheel factors between rounds below which the solution has converged."""
MIN_LINKED_FRACTION = 0.8
"""Minimum fraction of the stations that must be linked by scan matches."""


class CalibrationDrive(NamedTuple):
    """A measured calibration drive: legs and squares for the calibration, and squares for its validation."""

    stations: Sequence[Station]
    legs: Sequence[DriveSegment]
    squares: Sequence[Square]
    validation_squares: Sequence[Square]


class CalibrationResult(NamedTuple):
    """The result of a calibration, with its validation.

    solution: wheels and sensor by least squares. validation: the same from the validation drives alone, which
    gives their station poses. umbmark: E_d, E_b.

    before: return errors of the calibration squares with the assumed wheels; after: of the validation squares
    with the calibrated wheels; after_assumed: of the validation squares with the assumed wheels; by_umbmark: of
    the validation squares with the wheels of UMBmark. links: number of scan matches.
    """

    solution: Solution
    validation: Solution
    gyro: GyroSolution
    umbmark: Umbmark
    before: ReturnErrors
    after: ReturnErrors
    after_assumed: ReturnErrors
    by_umbmark: ReturnErrors
    links: int


def calibrate(drive: CalibrationDrive, assumed: WheelParams, sensor: SE2) -> CalibrationResult:
    """Calibrate wheels, sensor mount and gyro from a drive, and validate the result.

    assumed: wheels, and `sensor` the pose of the scanning sensor on the robot, both from the robot file. No
    data of the validation is used to calibrate. Its station poses come from scan matches and wheels of its
    own: at a station that sees a single wall only the ticks constrain the pose along it, and the wheels under
    test must not do that. Raise CalibrationError if the drive is insufficient: too short, no overlapping scans,
    slipping wheels, a dead gyro.
    """
    if not (drive.squares and drive.validation_squares):
        raise CalibrationError("no square was completed; run the calibration to its last square")
    surfaces = [Surface(station.walls) for station in drive.stations]
    poses = [station.pose for station in drive.stations]
    known = drive.squares[-1].legs[-1].stations[1] + 1
    # Calibration: stations up to the end of the last calibration square
    legs = [leg for leg in drive.legs if leg.stations[1] < known]
    solution, found_links = _match_and_solve(legs, surfaces[:known], poses[:known], assumed, sensor)
    # Validation: later stations, from the last calibrated pose on
    later_poses = [solution.poses[-1] @ poses[known - 1].between(pose) for pose in poses[known:]]
    later_legs = [leg for leg in drive.legs if leg.stations[1] >= known]
    again, later_links = _match_and_solve(
        later_legs, surfaces, [*solution.poses, *later_poses], assumed, solution.sensor, known
    )
    # Gyro, and UMBmark for comparison
    gyro = solve_gyro([leg.between(solution.poses) for leg in legs])
    squares = [square.between(solution.poses) for square in drive.squares]
    checks = [square.between(again.poses) for square in drive.validation_squares]
    ratios, corrected = umbmark(squares, assumed, solution.sensor)
    return CalibrationResult(
        solution,
        again,
        gyro,
        ratios,
        return_errors(squares, assumed, solution.sensor),
        return_errors(checks, solution.wheels, solution.sensor),
        return_errors(checks, assumed, solution.sensor),
        return_errors(checks, corrected, solution.sensor),
        len(found_links) + len(later_links),
    )


def _match_and_solve(
    legs: Sequence[DriveSegment],
    surfaces: Sequence[Surface],
    poses: Sequence[SE2],
    assumed: WheelParams,
    sensor: SE2,
    known: int = 0,
) -> tuple[Solution, list[ScanMatch]]:
    """Alternate scan matching and least squares; the poses of the first `known` stations are fixed."""
    previous = np.ones(3)
    for _ in range(ROUNDS):
        found_links = link_stations(poses, surfaces, known)
        _check_links(found_links, known, len(surfaces))
        solution = solve(legs, found_links, poses, assumed, sensor, known)
        poses, factors = solution.poses, np.array(solution.wheels.factors(assumed))
        if np.abs(factors - previous).max() < CONVERGENCE_CHANGE:
            break
        previous = factors
    return solution, found_links


def _check_links(found_links: Sequence[ScanMatch], known: int, station_count: int) -> None:
    linked = {link.first for link in found_links} | {link.second for link in found_links}
    count, total = len([station for station in linked if station >= known]), station_count - known
    if count < MIN_LINKED_FRACTION * total:
        raise CalibrationError(
            f"at {total - count} of {total} stations the scan overlaps too little with the others "
            f"(fewer than {MIN_COMMON_POINTS} points of walls); calibrate in a room with walls within its reach"
        )
