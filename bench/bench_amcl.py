"""AMCL: time of one update by number of particles, and of the likelihood field, beside C++ implementations.

The C++ figures (ROS 1 amcl -O2; beluga -O3 for the native processor, sequential) were measured separately on
two Xeon cores with the same sizes: a generated office of 1000 x 1000 cells of 0.05 m, 64 beams, N particles,
initial standard deviation 0.5 m.
"""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.localization import clusters, odometry_motion, resampling, tempering
from chefbot.localization.amcl import Amcl
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.pose_bins import PoseBins
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2

BEAMS = 64
PEERS_MS = {500: (1.31, 0.271), 2000: (6.30, 1.09), 10_000: (60.5, 5.68), 100_000: (3876.0, 70.2)}
STEP = SE2(0.1, 0.0, 0.05)


def milliseconds(call: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Return median and minimum time of a call, after one warm-up call."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append((time.perf_counter() - begin) * 1e3)
    return float(np.median(times)), min(times)


def office(cells: int, seed: int) -> Grid:
    """Return a free hall with walls every 4 to 8 m that have doors."""
    rng = np.random.default_rng(seed)
    out = np.zeros((cells, cells), np.int8)
    out[[0, -1], :] = out[:, [0, -1]] = 100
    at = 0
    while (at := at + int(rng.integers(80, 160))) < cells:
        out[at, :] = out[:, at] = 100
        for door in rng.integers(0, cells - 20, cells // 60):
            out[at, door : door + 20] = out[door : door + 20, at] = 0
    return Grid(out, 0.05, 0.0, 0.0)


def scan(grid: Grid, pose: SE2, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ranges up to 12 m, found in steps of half a cell."""
    out = np.full(angles.size, np.inf)
    for i, angle in enumerate(angles + pose.yaw):
        for r in np.arange(0.1, 12.0, 0.025):
            if grid.at(pose.x + r * np.cos(angle), pose.y + r * np.sin(angle)) >= 65:
                out[i] = r
                break
    return out


def whole_update(grid: Grid, params: AmclParams, repeats: int) -> tuple[float, float]:
    """Measure the complete `Amcl.update`, with beam ends, refinement and confidence; the robot shuttles between
    two poses."""
    poses = [SE2(25.0, 25.0, 0.3), SE2(25.2, 25.1, 0.4)]
    angles = np.linspace(-np.pi, np.pi, 640, endpoint=False)
    scans = [scan(grid, pose, angles) for pose in poses]
    amcl = Amcl(params, grid, IDENTITY)
    amcl.set_pose(poses[0], 0.1, 0.1)
    turns = itertools.cycle((0, 1))

    def update() -> None:
        k = next(turns)
        if not amcl.update(angles, scans[k], 12.0, poses[k]):
            raise RuntimeError("the benchmark's robot did not move enough for an update")

    for _ in range(6):
        update()
    return milliseconds(update, repeats)


def parts(grid: Grid, params: AmclParams, n: int, repeats: int) -> list[tuple[float, float]]:
    """Measure motion, weights, tempering, resampling and clusters, the steps that the C++ totals include."""
    here = SE2(25.0, 25.0, 0.3)
    angles = np.linspace(-np.pi, np.pi, BEAMS, endpoint=False)
    ranges = scan(grid, here, angles)
    met = np.isfinite(ranges)
    points = (ranges[met] * np.stack([np.cos(angles[met]), np.sin(angles[met])])).T
    rng, field, bins = np.random.default_rng(0), LikelihoodField.of(grid, params), PoseBins(grid)
    particles = here.array() + rng.normal(size=(n, 3)) * (0.05, 0.05, 0.05)
    even, scores = np.full(n, 1.0 / n), field.log_likelihoods(particles, points)

    def temper() -> None:
        tempering.weights_of(scores, even, tempering.exponent_for(scores, even, 1.0, 0.25))

    return [
        milliseconds(lambda: odometry_motion.move(particles.copy(), STEP, params, rng), repeats),
        milliseconds(lambda: field.log_likelihoods(particles, points), repeats),
        milliseconds(temper, repeats),
        milliseconds(lambda: resampling.resample(particles, even, bins, params, rng, n, n), repeats),
        milliseconds(lambda: clusters.heaviest(particles, even, bins), repeats),
    ]


def report(grid: Grid, n: int) -> None:
    params = AmclParams(min_particles=n, max_particles=n, max_beams=BEAMS, beam_independence=0.0)
    repeats = 15 if n >= 100_000 else 60
    pieces = parts(grid, params, n, repeats)
    whole, minimum = whole_update(grid, params, repeats)
    detail = " + ".join(f"{median:.3f}" for median, _ in pieces)
    same = sum(median for median, _ in pieces)
    per_read = pieces[1][0] * 1e6 / n / BEAMS
    ros, beluga = PEERS_MS[n]
    print(
        f"{n:7d} {whole:8.3f} ({minimum:8.3f}); {same:7.3f} = {detail} | {per_read:5.2f} |"
        f" {ros:7.2f} {ros / whole:5.1f}x {ros / same:5.1f}x |"
        f" {beluga:6.2f} {beluga / whole:5.1f}x {beluga / same:5.1f}x"
    )


def main() -> None:
    grid = office(1000, 1)
    print(f"one core of {os.cpu_count()}; ms, median (min), {BEAMS} beams, map 1000 x 1000")
    print("update: complete Amcl.update, with tempering and refinement, which the C++ versions do not have")
    print("parts: the steps that the C++ totals include")
    print("      N   update (min);   parts = motion + weights + tempering + resampling + clusters")
    print(
        "        | weights, ns per particle*beam | ROS 1 amcl, ratio to update, to parts | beluga, the same"
    )
    for n in PEERS_MS:
        report(grid, n)
    print("likelihood field, ms: C++ at 1000 x 1000: amcl 217-235, beluga 127-135")
    for cells in (250, 500, 1000, 2000):
        square = office(cells, 1)
        median, minimum = milliseconds(lambda g=square: LikelihoodField.of(g, AmclParams()), 8)  # type: ignore[misc]
        print(f"{cells:5d} x {cells:<5d} {median:7.1f} ({minimum:7.1f})")


if __name__ == "__main__":
    main()
