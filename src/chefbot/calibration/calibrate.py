"""From what a drive measured to the robot's numbers, and how well they were proved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from chefbot.calibration.alignment import FEWEST, Link, links
from chefbot.calibration.drive import Leg, Square, Stand
from chefbot.calibration.gyro import GyroSolution, solve_gyro
from chefbot.calibration.solve import Solution, solve
from chefbot.calibration.surface import Surface
from chefbot.calibration.umbmark import ReturnErrors, Umbmark, return_errors, umbmark
from chefbot.calibration.wheels import Wheels
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2

ROUNDS = 4
"""Matching and solving in turn: a better guess of where the stands are finds more walls that two of them share."""
SETTLED = 2e-5
"""Change of the wheels' numbers from round to round that is none."""
LEAST_SHARE_LINKED = 0.8
"""Of the stands, that scans must hold together."""


class Drive(NamedTuple):
    """All that was measured: the legs and squares to calibrate by, and the squares to check it with."""

    stands: Sequence[Stand]
    legs: Sequence[Leg]
    squares: Sequence[Square]
    checks: Sequence[Square]


class Calibrated(NamedTuple):
    """solution: wheels and sensor by least squares. again: the same of the check alone, which found where it stood.
    umbmark: E_d, E_b, and by_umbmark_wheels the wheels corrected by them.

    before: return errors of the squares to calibrate by, with the assumed wheels; after: of those driven to check,
    with the new ones; unchanged: of the same with the assumed ones; by_umbmark: of the same by UMBmark's.
    """

    solution: Solution
    again: Solution
    gyro: GyroSolution
    umbmark: Umbmark
    by_umbmark_wheels: Wheels
    before: ReturnErrors
    after: ReturnErrors
    unchanged: ReturnErrors
    by_umbmark: ReturnErrors
    links: int


def calibrate(drive: Drive, assumed: Wheels, sensor: SE2) -> Calibrated:
    """UserError where the drive does not tell: too short, no walls shared, slipping wheels, a dead gyro.

    assumed: wheels, and `sensor` the place of what scans, by the robot file. Nothing of the check is used to find the
    wheels. Where it stood is found by the walls and by wheels of its own: a stand that sees one wall is held along it
    by its ticks only, and the numbers that are to be proved may not hold it.
    """
    if not (drive.squares and drive.checks):
        raise UserError("no square was driven to its end; let the calibration go on to its last one")
    surfaces = [Surface(stand.walls) for stand in drive.stands]
    poses = [stand.pose for stand in drive.stands]
    known = drive.squares[-1].legs[-1].stands[1] + 1
    legs = [leg for leg in drive.legs if leg.stands[1] < known]
    solution, found = _solved(legs, surfaces[:known], poses[:known], assumed, sensor)
    onward = [solution.poses[-1] @ poses[known - 1].between(pose) for pose in poses[known:]]
    rest = [leg for leg in drive.legs if leg.stands[1] >= known]
    again, more = _solved(rest, surfaces, [*solution.poses, *onward], assumed, solution.sensor, known)
    gyro = solve_gyro([leg.between(solution.poses) for leg in legs])
    squares = [square.between(solution.poses) for square in drive.squares]
    checks = [square.between(again.poses) for square in drive.checks]
    ratios, corrected = umbmark(squares, assumed, solution.sensor)
    return Calibrated(
        solution,
        again,
        gyro,
        ratios,
        corrected,
        return_errors(squares, assumed, solution.sensor),
        return_errors(checks, solution.wheels, solution.sensor),
        return_errors(checks, assumed, solution.sensor),
        return_errors(checks, corrected, solution.sensor),
        len(found) + len(more),
    )


def _solved(
    legs: Sequence[Leg],
    surfaces: Sequence[Surface],
    poses: Sequence[SE2],
    assumed: Wheels,
    sensor: SE2,
    known: int = 0,
) -> tuple[Solution, list[Link]]:
    """Matched and solved in turn; the first `known` stands stay."""
    before = np.ones(3)
    for _ in range(ROUNDS):
        found = links(poses, surfaces, known)
        _check_links(found, known, len(surfaces))
        solution = solve(legs, found, poses, assumed, sensor, known)
        poses, now = solution.poses, np.array(solution.wheels.factors(assumed))
        if np.abs(now - before).max() < SETTLED:
            break
        before = now
    return solution, found


def _check_links(found: Sequence[Link], known: int, stands: int) -> None:
    linked = {link.first for link in found} | {link.second for link in found}
    held, wanted = len([stand for stand in linked if stand >= known]), stands - known
    if held < LEAST_SHARE_LINKED * wanted:
        raise UserError(
            f"at {wanted - held} of {wanted} stands the sensor saw too little that it saw from elsewhere too "
            f"(fewer than {FEWEST} points of walls); calibrate in a room with walls within its reach"
        )
