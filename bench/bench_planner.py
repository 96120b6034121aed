"""The global planner on office maps, beside NavFn, Theta* and Smac 2D of Nav2 (C++)."""

from __future__ import annotations

import os
import time

import numpy as np
from bench_costmap import INSCRIBED_RADIUS, RESOLUTION, office

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


def milliseconds(planner: GridPlanner, costmap: Costmap, a: SE2, b: SE2 | None) -> tuple[float, float]:
    """Return (best CPU ms of several calls, path length in m); of the whole potential without `b`."""
    best, length = np.inf, 0.0
    for _ in range(REPEATS):
        start = time.process_time_ns()
        if b is None:
            planner.potential(costmap, a)
        else:
            length = path_length(planner.plan(costmap, a, b))
        best = min(best, (time.process_time_ns() - start) / 1e6)
    return best, length


def main() -> None:
    """Print corner to corner and the median of random queries, for maps of increasing size."""
    print(f"one core of {os.cpu_count()}; best CPU ms of {REPEATS} per query: corner / median of {QUERIES}")
    for n, peers in PEERS.items():
        rng = np.random.default_rng(n)
        cells = inflate(office(n, rng), cost_table(RESOLUTION, INSCRIBED_RADIUS, 0.55, 10.0))
        costmap, planner = Costmap(cells, RESOLUTION, 0.0, 0.0), GridPlanner()
        a, b = nearest_free(costmap, 0, 0), nearest_free(costmap, n, n)
        milliseconds(planner, costmap, a, b)
        corner, length = milliseconds(planner, costmap, a, b)
        pairs = [(free_pose(costmap, rng), free_pose(costmap, rng)) for _ in range(QUERIES)]
        queries = [milliseconds(planner, costmap, *pair)[0] for pair in pairs]
        field = milliseconds(planner, costmap, a, None)[0]
        print(
            f"{n}x{n}: {corner:.2f} / {np.median(queries):.2f} (max {max(queries):.2f}), path {length:.1f} m"
        )
        print(f"      C++: {peers}")
        print(f"      whole field {field:.2f}; C++ NavFn full wavefront {WAVEFRONT[n]}")


if __name__ == "__main__":
    main()
