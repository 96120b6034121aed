"""Calibration of the probability that localization states: how often is the pose right where it is 80 %?

Drives through generated buildings, on their true map, of which parts are missing, with people in the scan: a global
start, a wrong initial pose, a right one, and a robot that is carried elsewhere. Each update of the filter is a case;
a pose is right within 0.25 m and 10 degrees. Even seeds are for fitting, odd ones for judging.

    python bench/bench_pose_probability.py --seeds 2,4,6,8 --fit     # prints the weights
    python bench/bench_pose_probability.py --seeds 1,3,5,7           # expected calibration error
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from simulated_drives import KINDS, ROBOT, SimulatedDrive, simulated_drive

from chefbot.localization.amcl import Amcl
from chefbot.localization.params import AmclParams
from chefbot.localization.pose_probability import ANGLE_LIMIT, POSITION_LIMIT, WEIGHTS
from chefbot.maths.angles import wrap
from chefbot.maths.grid import FREE, Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import RecordedScan

STARTS = ("global", "wrong", "right", "carried")
LENGTH, MAX_UPDATES = 30.0, 80
"""Length of a drive, m, and number of updates of the filter in a case."""
MISSING, MISSING_SIZE = 8, (0.3, 1.2)
"""Number of pieces that are missing in the map, and their side, m."""
MAX_HIDDEN, PEOPLE, PEOPLE_RANGE = 0.5, 6, (0.4, 2.5)
"""Largest share of the beams that people hide in a drive, number of sectors that they hide, and their range, m."""
BINS = 10
"""Number of bins of equal width of the probability."""
PENALTY = 1e-5
"""Weight of the squared weights in the fit, which keeps them finite."""


class Case(NamedTuple):
    """One update: the inputs of the regression, and whether the pose was right."""

    features: np.ndarray
    right: bool


def cases_of(job: tuple[str, int, str]) -> list[Case]:
    """Return the cases of a drive in one building."""
    kind, seed, start = job
    drive = simulated_drive(kind, seed, 1.0, LENGTH)
    rng = np.random.default_rng([seed, KINDS.index(kind) if kind in KINDS else 99, STARTS.index(start)])
    mount = ROBOT.sensors.lidar.mount  # type: ignore[union-attr]
    grid = with_missing_pieces(drive.true_map, rng)
    amcl = Amcl(AmclParams(seed=seed), grid, SE2(mount.x, mount.y, 0.0))
    begin = int(rng.integers(max(1, len(drive.scans) // 2)))
    drive = drive._replace(scans=with_people(drive.scans, rng))
    if start in ("wrong", "right"):
        away = drive.truth[int(rng.integers(len(drive.truth)))] if start == "wrong" else drive.truth[begin]
        amcl.set_pose(away, 0.3, 0.2)
    return list(_cases(amcl, drive, begin, start, rng))


def _cases(
    amcl: Amcl, drive: SimulatedDrive, begin: int, start: str, rng: np.random.Generator
) -> Iterator[Case]:
    updates, offset, last = 0, 0, SE2(0.0, 0.0, 0.0)
    jump = int(rng.integers(15, 40)) if start == "carried" else -1
    for k in range(begin, len(drive.scans)):
        if updates == MAX_UPDATES:
            return
        index = k + offset
        if updates == jump and offset == 0:
            offset = int(rng.integers(-k, len(drive.scans) - k))
            index = k + offset  # the odometry does not notice
            odom_before = last
            correction = odom_before @ drive.scans[index].odom.inverse()
        if not 0 <= index < len(drive.scans):
            return
        scan = drive.scans[index]
        last = scan.odom if offset == 0 else correction @ scan.odom
        if amcl.update(scan.angles, scan.ranges, 1e3, last):
            updates += 1
            error = drive.truth[index].between(amcl.pose)
            right = math.hypot(error.x, error.y) <= POSITION_LIMIT and abs(wrap(error.yaw)) <= ANGLE_LIMIT
            yield Case(amcl.quality.features(), right)


def with_missing_pieces(grid: Grid, rng: np.random.Generator) -> Grid:
    """Return the map without what stands in some rectangles."""
    cells = grid.cells.copy()
    rows, columns = cells.shape
    for _ in range(MISSING):
        size = rng.uniform(*MISSING_SIZE, 2) / grid.resolution
        row, column = int(rng.integers(rows)), int(rng.integers(columns))
        part = cells[row : row + int(size[0]), column : column + int(size[1])]
        part[part > FREE] = FREE
    return Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)


def with_people(scans: list[RecordedScan], rng: np.random.Generator) -> list[RecordedScan]:
    """Return the scans with sectors that people hide, who walk slowly around the robot."""
    share, bearings = float(rng.uniform(0.0, MAX_HIDDEN)), rng.uniform(-np.pi, np.pi, PEOPLE)
    near = rng.uniform(*PEOPLE_RANGE, PEOPLE)
    hidden = []
    for scan in scans:
        bearings = bearings + 0.05 * rng.normal(size=PEOPLE)
        ranges = scan.ranges.copy()
        for bearing, distance in zip(bearings, near, strict=True):
            apart = np.abs(np.angle(np.exp(1j * (scan.angles - bearing))))
            ranges[(apart < np.pi * share / PEOPLE) & ~(ranges < distance)] = distance
        hidden.append(replace(scan, ranges=ranges))
    return hidden


def fit(features: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the weights with the largest likelihood (iteratively reweighted least squares)."""
    weights = np.zeros(features.shape[1])
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-features @ weights))
        hessian = (features * (p * (1.0 - p))[:, np.newaxis]).T @ features + PENALTY * len(p) * np.eye(
            len(weights)
        )
        gradient = features.T @ (right - p) - PENALTY * len(p) * weights
        weights += np.linalg.solve(hessian, gradient)
    return weights


def report(probability: np.ndarray, right: np.ndarray) -> float:
    """Print the share of right poses by stated probability; return the expected calibration error."""
    bins = np.minimum((probability * BINS).astype(int), BINS - 1)
    error = 0.0
    print("stated      cases  right")
    for i in range(BINS):
        chosen = bins == i
        if chosen.any():
            stated, true, n = probability[chosen].mean(), right[chosen].mean(), int(chosen.sum())
            error += n / len(right) * abs(stated - true)
            print(f"{100 * stated:5.1f} %  {n:8d}  {100 * true:5.1f} %")
    return error


def main() -> None:
    """Measure, and fit if asked to."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="1,3,5,7")
    parser.add_argument("--kinds", default=",".join((*KINDS, "twins")))
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--keep", default="", help="file for the cases, NPZ")
    given = parser.parse_args()
    jobs = [
        (kind, seed, start)
        for seed in map(int, given.seeds.split(","))
        for kind in given.kinds.split(",")
        for start in STARTS
    ]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        by_job = list(pool.map(cases_of, jobs))
    cases = [case for found in by_job for case in found]
    features, right = (
        np.array([case.features for case in cases]),
        np.array([case.right for case in cases], float),
    )
    if given.keep:
        kinds = np.repeat([job[0] for job in jobs], [len(found) for found in by_job])
        starts = np.repeat([job[2] for job in jobs], [len(found) for found in by_job])
        np.savez(given.keep, features=features, right=right, kinds=kinds, starts=starts)
    weights = fit(features, right) if given.fit else WEIGHTS
    if given.fit:
        print("weights:", ", ".join(f"{one:.3f}" for one in weights))
    error = report(1.0 / (1.0 + np.exp(-features @ weights)), right)
    print(f"{len(cases)} updates, {100 * right.mean():.1f} % right; expected calibration error {error:.3f}")


if __name__ == "__main__":
    main()
