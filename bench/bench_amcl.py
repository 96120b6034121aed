"""AMCL: time of one update by number of particles, and of the field of a map, beside the C++ peers.

The peers' figures (ROS 1 amcl -O2; beluga -O3 for the native processor, sequential) were measured apart on
two Xeon cores with the same sizes: a made-up office of 1000 x 1000 cells at 0.05 m, 64 beams, N particles
held fixed, start spread 0.5 m.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.localization import clusters, odometry_motion, resampling, tempering
from chefbot.localization.amcl import Amcl
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.mapping.grid import Grid
from chefbot.maths.se2 import SE2

BEAMS = 64
PEERS_MS = {500: (1.31, 0.271), 2000: (6.30, 1.09), 10_000: (60.5, 5.68), 100_000: (3876.0, 70.2)}
STEP = SE2(0.1, 0.0, 0.05)


def milliseconds(call: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Median and least time of a call, after one to warm up."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append((time.perf_counter() - begin) * 1e3)
    return float(np.median(times)), min(times)


def office(cells: int, seed: int) -> Grid:
    """Walls every 4 to 8 m with doors, in a free hall."""
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
    """Ranges by marching half a cell at a time up to 12 m."""
    out = np.full(angles.size, np.inf)
    for i, angle in enumerate(angles + pose.yaw):
        for r in np.arange(0.1, 12.0, 0.025):
            if grid.at(pose.x + r * np.cos(angle), pose.y + r * np.sin(angle)) >= 65:
                out[i] = r
                break
    return out


def one_update(grid: Grid, n: int) -> None:
    params = AmclParams(min_particles=n, max_particles=n, max_beams=BEAMS, beam_independence=0.0)
    here = SE2(25.0, 25.0, 0.3)
    angles = np.linspace(-np.pi, np.pi, 640, endpoint=False)
    ranges = scan(grid, here, angles)
    amcl = Amcl(params, grid, SE2(0.0, 0.0, 0.0))
    repeats = 15 if n >= 100_000 else 60
    met = np.isfinite(ranges)
    ends = np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1)[met]
    points = ends[np.linspace(0, len(ends) - 1, BEAMS).astype(int)]

    def update() -> None:
        amcl.set_pose(here, 0.05, 0.05)
        amcl.update(angles, ranges, 12.0, here)

    # the parts of an update, at the spread at which the peers were measured: after the start has settled
    amcl.set_pose(here, 0.05, 0.05)
    particles = np.resize(amcl.particles, (n, 3))
    even = np.full(n, 1.0 / n)
    rng = np.random.default_rng(0)
    move = milliseconds(lambda: odometry_motion.move(particles.copy(), STEP, params, rng), repeats)
    weigh = milliseconds(lambda: amcl.field.weigh(particles, points), repeats)
    scores = amcl.field.weigh(particles, points)
    temper = milliseconds(
        lambda: tempering.weights_of(scores, even, tempering.exponent_for(scores, even, 1.0, 0.25)), repeats
    )
    draw = milliseconds(lambda: resampling.resample(particles, even, amcl._bins, params, rng), repeats)
    group = milliseconds(lambda: clusters.heaviest(particles, even, amcl._bins), repeats)
    parts = (move, weigh, temper, draw, group)
    total, least = (sum(p[k] for p in parts) for k in (0, 1))
    ros, beluga = PEERS_MS[n]
    detail = " + ".join(f"{p[0]:.3f}" for p in parts)
    print(
        f"{n:7d} {total:8.3f} ({least:8.3f}) = {detail} | {weigh[1] * 1e6 / n / BEAMS:5.2f} |"
        f" {ros:7.2f} {ros / total:6.1f}x | {beluga:6.2f} {beluga / total:5.1f}x"
    )


def main() -> None:
    grid = office(1000, 1)
    print(f"one core of {os.cpu_count()}; ms, median (min), {BEAMS} beams, map 1000 x 1000")
    print(
        "      N    total (min) = motion + weights + tempering + resampling + clusters | ns per particle*beam"
    )
    print("        | ROS 1 amcl, times ours | beluga native, times ours")
    for n in PEERS_MS:
        one_update(grid, n)
    print("field build, ms: peers at 1000 x 1000 amcl 217-235, beluga 127-135")
    for cells in (250, 500, 1000, 2000):
        square = office(cells, 1)
        median, least = milliseconds(lambda g=square: LikelihoodField.of(g, AmclParams()), 8)  # type: ignore[misc]
        print(f"{cells:5d} x {cells:<5d} {median:7.1f} ({least:7.1f})")


if __name__ == "__main__":
    main()
