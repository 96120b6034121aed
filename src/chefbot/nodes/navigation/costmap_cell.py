"""A cell of a costmap as a message: its cost, and what marked it."""

from __future__ import annotations

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs.navigation import CostmapCell, CostmapMark
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.causes.reports import marking_sensor
from chefbot.robot.spec import Robot


def cell_message(header: Header, costs: LayeredCostmap, point: SE2, robot: Robot) -> CostmapCell:
    """Return the cell at a point in the costmap's frame; outside of it, the point itself."""
    costmap = costs.update()
    if not costmap.contains(point.x, point.y):
        return CostmapCell(header, Point(point.x, point.y, 0.0), costmap.resolution)
    row, column = costmap.cell(point.x, point.y)
    marks = tuple(
        CostmapMark(marking_sensor(mark.source, robot), Time.of(round(mark.time * 1e9)))
        for mark in costs.marks(point.x, point.y)
    )
    centre = Point(*costmap.centre(row, column), 0.0)
    return CostmapCell(
        header, centre, costmap.resolution, inside=True, cost=int(costmap.cells[row, column]), marks=marks
    )
