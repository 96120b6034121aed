"""Inflation and ray tracing, beside the figures of Nav2 in C++ on the same type of machine."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.inflation import cost_table, inflate
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.raytrace import mark_and_clear
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

RESOLUTION, INSCRIBED_RADIUS = 0.05, 0.22
NAV2_INFLATION_MS = {
    (60, 0.55): 0.034,
    (100, 0.55): 0.103,
    (200, 0.55): 0.445,
    (1000, 0.55): 13.9,
    (2000, 0.55): 65.3,
}
NAV2_INFLATION_MS |= {(2000, 1.0): 96.1}
NAV2_WINDOW_MS = {1000: 0.52, 2000: 0.58}
NAV2_RAYTRACE_US = {(200, 3.0): 68.0, (200, 30.0): 77.0, (1000, 30.0): 88.0}


def office(n: int, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return (n, n) rooms of 4 to 7 m with doors of 0.9 m and furniture; walls are two cells thick."""
    cells = np.zeros((n, n), np.uint8)
    lines = np.cumsum(rng.integers(80, 140, n // 80 + 2))
    for at in lines[lines < n - 2]:
        cells[at : at + 2, :] = 254
        cells[:, at : at + 2] = 254
    for at in lines[lines < n - 2]:
        for other in [0, *lines[lines < n - 40]]:
            door = int(other) + int(rng.integers(10, 50))
            cells[at : at + 2, door : door + 18] = 0
            cells[door : door + 18, at : at + 2] = 0
    for _ in range(n * n // 4000):
        r, c = rng.integers(4, n - 16, 2)
        cells[r : r + rng.integers(1, 12), c : c + rng.integers(1, 12)] = 254
    cells[[0, -1], :] = 254
    cells[:, [0, -1]] = 254
    return cells


def milliseconds(call: Callable[[], object], min_repeats: int = 9) -> tuple[float, float]:
    """Return (median, minimum) CPU ms of the call after one warm-up call."""
    call()
    times = []
    while len(times) < min_repeats or (sum(times) < 0.2e9 and len(times) < 200):
        start = time.process_time_ns()
        call()
        times.append(time.process_time_ns() - start)
    return float(np.median(times)) / 1e6, min(times) / 1e6


def after_a_scan(n: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return (median, minimum) CPU ms of the layered costmap's update after each of several scans."""
    walls = np.where(office(n, rng) == 254, 100, 0).astype(np.int8)
    costs = LayeredCostmap(CostmapParams(), disc(INSCRIBED_RADIUS))
    costs.set_static(Grid(walls, RESOLUTION, 0.0, 0.0))
    costs.update()
    angles, times = np.linspace(-np.pi, np.pi, 640, endpoint=False), []
    for step in range(30):
        pose = SE2(n * RESOLUTION / 2 + 0.05 * step, n * RESOLUTION / 2, 0.1 * step)
        costs.mark_and_clear("scan", pose, angles, rng.gamma(3.0, 1.2, 640))
        start = time.process_time_ns()
        costs.update()
        times.append((time.process_time_ns() - start) / 1e6)
    return float(np.median(times)), min(times)


def main() -> None:
    """Print the tables."""
    rng = np.random.default_rng(1)
    print(f"one core of {os.cpu_count()}; CPU time, median (min); beside Nav2's C++ on an idle machine")
    for (n, radius), peer in NAV2_INFLATION_MS.items():
        cells = office(n, rng)
        table = cost_table(RESOLUTION, INSCRIBED_RADIUS, radius, 10.0)
        median, minimum = milliseconds(lambda cells=cells, table=table: inflate(cells, table))  # type: ignore[misc]
        print(f"inflation {n:4}x{n:<4} r {radius:.2f}: {median:7.3f} ({minimum:.3f}) ms   C++ {peer} ms")
    for n, window in NAV2_WINDOW_MS.items():
        median, minimum = after_a_scan(n, rng)
        print(f"all layers {n}x{n}, after one scan: {median:.3f} ({minimum:.3f}) ms   C++ {window} ms")
    angles = np.linspace(-np.pi, np.pi, 640, endpoint=False)
    for (n, reach), peer in NAV2_RAYTRACE_US.items():
        cells = np.full((n, n), 255, np.uint8)
        ranges = np.minimum(rng.gamma(3.0, 1.2, 640), reach)
        pose, times = np.array([n * RESOLUTION / 2, n * RESOLUTION / 2, 0.3]), np.zeros((n, n))

        def scan(
            cells: NDArray[np.uint8] = cells,
            times: NDArray[np.float64] = times,
            pose: NDArray[np.float64] = pose,
            r: NDArray[np.float64] = ranges,
        ) -> None:
            mark_and_clear(
                cells, RESOLUTION, 0.0, 0.0, pose, angles, r, np.zeros_like(r), r, cells, times, 0.0
            )

        median, minimum = milliseconds(scan)
        print(
            f"640 beams, {n}x{n}, to {reach} m: {median * 1e3:.0f} ({minimum * 1e3:.0f}) us   C++ {peer} us"
        )


if __name__ == "__main__":
    main()
