"""A custom planner: a class, named in a launch file, whose paths the simulated robot follows.

    python examples/01_a_planner.py [run.mcap]
    chefbot launch examples/01_a_planner.yaml world:=room

The planner is Latombe's NF1 (Robot Motion Planning, 1991, 7.2): a wave expands from the goal over the
free cells, each cell stores its arrival time, and the path descends these times. It ignores costs, so it passes
obstacles at the inscribed radius; the built-in planner keeps more distance where there is room.
"""

import sys
from collections import deque
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import PlanningError, PlanningFailure

STEPS = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)]
STRIDE = 4  # cells between two poses of the path: fewer would follow the staircase of cells
Cell = tuple[int, int]


class Wavefront:
    """A planner with the interface of chefbot.planning.planner.Planner."""

    def __init__(self, settings: PlannerParams) -> None:
        """Accept the node's `settings`, which this planner does not use."""

    def plan(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Return poses (n, 3), x, y in m and yaw in rad, from start to goal in the map frame."""
        free = costmap.cells < INSCRIBED
        a, b = cell_of(costmap, start), cell_of(costmap, goal)
        for cell, pose, failure in (
            (a, start, PlanningFailure.START_OUTSIDE_MAP),
            (b, goal, PlanningFailure.GOAL_OUTSIDE_MAP),
        ):
            if not (0 <= cell[0] < free.shape[0] and 0 <= cell[1] < free.shape[1]):
                raise PlanningError(failure, pose)
        free[a] = True  # the robot may start within the inscribed radius
        if not free[b]:
            raise PlanningError(PlanningFailure.GOAL_OCCUPIED, goal)
        cells = walk_down(wave(free, b, a), a)
        if not cells:
            raise PlanningError(PlanningFailure.NO_VALID_PATH, goal)
        inner = np.array(cells[STRIDE:-STRIDE:STRIDE]).reshape(-1, 2)[:, ::-1]
        middles = (inner + 0.5) * costmap.resolution + (costmap.origin_x, costmap.origin_y)
        points = np.vstack([[start[:2]], middles, [goal[:2]]])
        ahead = np.diff(points, axis=0)
        return np.column_stack([points, np.append(np.arctan2(ahead[:, 1], ahead[:, 0]), goal.yaw)])


def cell_of(costmap: Costmap, pose: SE2) -> Cell:
    """Return the (row, column) of the cell at `pose`."""
    return (
        int((pose.y - costmap.origin_y) // costmap.resolution),
        int((pose.x - costmap.origin_x) // costmap.resolution),
    )


def wave(free: NDArray[np.bool_], source: Cell, until: Cell) -> NDArray[np.int32]:
    """Return the arrival time (h, w) of the wave from `source`, -1 where it is later than at `until`."""
    came = np.full(free.shape, -1, np.int32)
    came[source] = 0
    front = deque([source])
    while front and came[until] < 0:
        row, column = front.popleft()
        for cell in neighbours(row, column, free.shape):
            if free[cell] and came[cell] < 0:
                came[cell] = came[row, column] + 1
                front.append(cell)
    return came


def walk_down(came: NDArray[np.int32], start: Cell) -> list[Cell]:
    """Return the cells from `start` to the source of the wave; empty if it did not arrive."""
    if came[start] < 0:
        return []
    cells = [start]
    while came[cells[-1]] > 0:
        below = [c for c in neighbours(*cells[-1], came.shape) if came[c] == came[cells[-1]] - 1]
        cells.append(below[0])  # straight steps come first in STEPS
    return cells


def neighbours(row: int, column: int, shape: tuple[int, ...]) -> list[Cell]:
    """Return the neighbours of a cell that are on the map."""
    around = [(row + r, column + c) for r, c in STEPS]
    return [(r, c) for r, c in around if 0 <= r < shape[0] and 0 <= c < shape[1]]


def main() -> None:
    """Explore the room with this planner, as fast as the processor allows."""
    from chefbot.launcher.session import session, start
    from chefbot.msgs.chefbot_msgs import Collision, ExplorationStatus
    from chefbot.msgs.nav_msgs import Path as PathMessage
    from chefbot.robot.load import load_robot
    from chefbot.runtime.launch import load_launch
    from chefbot.runtime.loop import Publication

    paths, touched, status = [0], [0], [ExplorationStatus()]

    def look(publication: Publication) -> None:
        """Observe every message, as a recorder does."""
        message = publication.message
        paths[0] += isinstance(message, PathMessage)
        touched[0] += isinstance(message, Collision)
        if isinstance(message, ExplorationStatus):
            status[0] = message

    launch = load_launch(
        str(Path(__file__).with_suffix(".yaml")), {"world": "room", "headless": "true", "pictures": "0"}
    )
    record = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    with session(load_robot("chefbot_lidar"), 1, launch.clock, 0.0, record) as system:
        system.loop.add_observer(look)
        start(system, launch)
        system.loop.run(until_ns=300_000_000_000, until=lambda: status[0].done)
        planner = type(system.nodes["planner"]._planner).__name__  # type: ignore[attr-defined]
    print(f"planner: {planner}, {paths[0]} paths")
    print(f"{system.loop.now_ns / 1e9:.0f} s: {status[0].description} {touched[0]} collisions.")


if __name__ == "__main__":
    main()
