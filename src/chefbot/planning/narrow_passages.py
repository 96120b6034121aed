"""Whether a map leaves a robot only passages in which its body just fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.ndimage

from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.planner import Planner, PlanningError


def is_map_narrow(planner: Planner, costs: Costmap, start: SE2, goal: SE2) -> bool:
    """Return whether the start is in a narrow passage or at its wall, or no wider path leads from there to the goal.

    costs: of the map, without the marks of sensors: what closes a wider path is marked, and may leave. A path is wide
    if it is open with one more cell on each side: a sensor may mark a wall a cell beside its place on the map.
    """
    beside = scipy.ndimage.binary_dilation(costs.cells >= INSCRIBED)
    wide = replace(costs, cells=np.where(beside, np.maximum(costs.cells, INSCRIBED), costs.cells))
    if wide.at(start.x, start.y) >= INSCRIBED:
        return True  # a planner may begin beside an occupied start, on the other side of the passage
    try:
        planner.plan(wide, start, goal)
    except PlanningError:
        return True
    return False
