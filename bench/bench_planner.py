"""The global planner on office maps, beside NavFn's A* in the same run, and the figures of Nav2's planners (C++)."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np
from bench_costmap import INSCRIBED_RADIUS, RESOLUTION, office
from navfn import NavFn
from numpy.typing import NDArray

from chefbot.costmap.inflation import cost_table, inflate
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner, path_length

PEERS = {
    400: "NavFn A* 3.49 / 0.77, NavFn Dijkstra 4.01 / 2.01, Theta* 19.7 / 2.77, Smac 2D 27.9 / 3.70",
    1000: "NavFn A* 28.5 / 5.70, NavFn Dijkstra 31.3 / 17.4, Theta* 174 / 19.0, Smac 2D 309 / 20.2",
    2000: "NavFn A* 128.5 / 40.8, NavFn Dijkstra 140.7 / 94.6, Theta* 573 / 123, Smac 2D 1428 / 206",
}
WAVEFRONT = {400: 3.75, 1000: 30.3, 2000: 135.5}
QUERIES, REPEATS = 20, 5


def free_pose(costmap: Costmap, rng: np.random.Generator) -> SE2:
    """Return a random pose in free space."""
    rows, columns = np.nonzero(costmap.cells == 0)
    i = int(rng.integers(len(rows)))
    return SE2(*costmap.centre(int(rows[i]), int(columns[i])), 0.0)


def nearest_free(costmap: Costmap, row: int, column: int) -> SE2:
    """Return the free cell nearest to a corner."""
    rows, columns = np.nonzero(costmap.cells == 0)
    i = int(np.argmin((rows - row) ** 2 + (columns - column) ** 2))
    return SE2(*costmap.centre(int(rows[i]), int(columns[i])), 0.0)


def cpu_milliseconds(call: Callable[[], object]) -> float:
    """Return the CPU time of a call, ms."""
    start = time.process_time_ns()
    call()
    return (time.process_time_ns() - start) / 1e6


class Query:
    """One query for both planners, with arrays and kernels ready."""

    def __init__(self, costmap: Costmap, planner: GridPlanner, peer: NavFn, a: SE2, b: SE2) -> None:
        self.costmap, self.planner, self.peer, self.a, self.b = costmap, planner, peer, a, b
        self.length = path_length(self.plan())
        if self.navfn() >= 1e10:
            raise SystemExit("NavFn finds no path where the planner finds one.")

    def plan(self) -> NDArray[np.float64]:
        """Return the planner's path."""
        return self.planner.plan(self.costmap, self.a, self.b)

    def navfn(self) -> float:
        """Return NavFn's potential of the start."""
        start, goal = (self.costmap.cell(pose.x, pose.y) for pose in (self.a, self.b))
        return self.peer.potential(self.costmap.cells, start, goal)

    def milliseconds(self) -> tuple[float, float]:
        """Return the best CPU ms of several alternating calls of planner and NavFn."""
        pairs = [(cpu_milliseconds(self.plan), cpu_milliseconds(self.navfn)) for _ in range(REPEATS)]
        return min(ours for ours, _ in pairs), min(navfn for _, navfn in pairs)


def compare(n: int) -> None:
    """Print corner to corner and the median of random queries on a map of n x n cells."""
    rng = np.random.default_rng(n)
    cells = inflate(office(n, rng), cost_table(RESOLUTION, INSCRIBED_RADIUS, 0.55, 10.0))
    costmap, planner, peer = Costmap(cells, RESOLUTION, 0.0, 0.0), GridPlanner(), NavFn(cells.shape)
    a, b = nearest_free(costmap, 0, 0), nearest_free(costmap, n, n)
    corner = Query(costmap, planner, peer, a, b)
    ours, navfn = corner.milliseconds()
    pairs = [(free_pose(costmap, rng), free_pose(costmap, rng)) for _ in range(QUERIES)]
    times = np.array([Query(costmap, planner, peer, *pair).milliseconds() for pair in pairs])
    medians, ratio = np.median(times, axis=0), float(np.median(times[:, 1] / times[:, 0]))
    field = min(cpu_milliseconds(lambda: planner.potential(costmap, a)) for _ in range(REPEATS))
    print(
        f"{n}x{n}: corner to corner ({corner.length:.1f} m) {ours:.2f}, NavFn {navfn:.2f}: {navfn / ours:.2f}; "
        f"median of {QUERIES} {medians[0]:.2f}, NavFn {medians[1]:.2f}: {ratio:.2f}"
    )
    print(f"      C++ on an idle machine, corner / median: {PEERS[n]}")
    peer.close()
    print(f"      whole field {field:.2f}; C++ NavFn full wavefront {WAVEFRONT[n]}")


def main() -> None:
    """Print a comparison for maps of increasing size."""
    print(
        f"one core of {os.cpu_count()}; best CPU ms of {REPEATS} calls per query, alternating; ratio NavFn / ours"
    )
    for n in PEERS:
        compare(n)


if __name__ == "__main__":
    main()
