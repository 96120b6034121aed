"""One command of the Dynamic Window Approach, beside ROS 1's dwa_local_planner (C++)."""

from __future__ import annotations

import os

import numpy as np
from bench_costmap import INSCRIBED_RADIUS, RESOLUTION, milliseconds, office

from chefbot.control.dwa import DwaController
from chefbot.control.dwa_params import DwaParams
from chefbot.costmap.inflation import cost_table, inflate
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.planner import PlanningError
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

PEERS = {(6, 20): 1.09, (20, 20): 3.18}
"""(v, w) samples: median ms of the C++ core, differential, 100 x 100 window, sim_time 1.7 s."""
POSES = 50


def main() -> None:
    """Print medians over poses on a path through an office map, in a window of 100 x 100 cells."""
    rng = np.random.default_rng(5)
    cells = inflate(office(400, rng), cost_table(RESOLUTION, INSCRIBED_RADIUS, 0.55, 10.0))
    costmap, planner = Costmap(cells, RESOLUTION, 0.0, 0.0), GridPlanner()
    free = np.argwhere(cells == 0)
    paths = []
    while len(paths) < POSES:
        a, b = (SE2(*costmap.centre(*(int(i) for i in free[rng.integers(len(free))])), 0.0) for _ in range(2))
        try:
            paths.append(planner.plan(costmap, a, b))
        except PlanningError:
            continue  # two rooms without a door between them: draw again
    print(f"one core of {os.cpu_count()}; CPU ms per command, median over {POSES} poses (min, max)")
    for (v, w), peer in PEERS.items():
        dwa = DwaController(
            Limits.of(load_robot("chefbot")), DwaParams(v_samples=v, w_samples=w, sim_time=1.7)
        )
        times = []
        for path in paths:
            pose = SE2.of(path[0])
            r, c = costmap.cell(pose.x, pose.y)
            top, left = max(0, r - 50), max(0, c - 50)
            window = np.ascontiguousarray(cells[top : top + 100, left : left + 100])
            local = Costmap(window, RESOLUTION, left * RESOLUTION, top * RESOLUTION)
            dwa.set_path(path)

            def call(dwa: DwaController = dwa, pose: SE2 = pose, local: Costmap = local) -> object:
                return dwa.command(pose, (0.3, 0.0), local)

            times.append(milliseconds(call, 30)[0])
        print(f"{v}x{w}: {np.median(times):.3f} ({min(times):.3f}, {max(times):.3f})   C++ {peer}")


if __name__ == "__main__":
    main()
