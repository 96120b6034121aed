"""The costmap of a node with the layers that its parameters name, and how a window of it follows the robot."""

from __future__ import annotations

from chefbot.costmap.layer import CostmapLayer, LayerSettings
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.layers import StaticLayer
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sources import DROP_OFFS
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot
from chefbot.runtime.plugins import load_plugin
from chefbot.scan.drop_offs import drop_range


def make_costmap(params: CostmapParams, robot: Robot, *, rolling: bool) -> LayeredCostmap:
    """Create the costmap of a robot, a window that follows it or as large as the map. UserError for a wrong layer.

    In the costmap of the map, a robot that sees only ahead keeps its radius from unknown space.
    """
    settings = LayerSettings(params, robot, drop_range(robot))
    layers: list[CostmapLayer] = [
        load_plugin(name, StaticLayer, settings, CostmapLayer) for name in params.layers
    ]
    avoid_unknown = robot.sensors.forward_sensing_only and not rolling
    return LayeredCostmap(
        params, robot.footprint, rolling=rolling, avoid_unknown=avoid_unknown, layers=layers
    )


def move_with_robot(costs: LayeredCostmap, pose: SE2) -> None:
    """Move a rolling costmap to the robot's pose in its frame, and clear what the robot covers."""
    costs.move_to(*pose[:2])
    costs.clear_footprint(pose, keep=(DROP_OFFS,))  # its edge may be over one
    if costs.has_source(DROP_OFFS):
        costs.clear_around(pose, costs.resolution, DROP_OFFS)
