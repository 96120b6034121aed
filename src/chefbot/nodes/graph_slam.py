"""Graph SLAM on a running robot: loops are closed while it drives."""

from __future__ import annotations

from pathlib import Path

import msgspec

from chefbot.maths.se2 import SE2
from chefbot.msgs.std_msgs import String
from chefbot.nodes.scans.continued_map import ContinuedMap
from chefbot.nodes.scans.mapper import MapperNode, MapperNodeParams
from chefbot.runtime.node import In, restored
from chefbot.scan.usable_range import usable_range
from chefbot.slam.graph import GraphSlam, GraphSlamParams
from chefbot.slam.offline import Slam
from chefbot.slam.session import START_STD_XY, START_STD_YAW


class GraphSlamNodeParams(MapperNodeParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the graph mapper."""

    graph: GraphSlamParams = GraphSlamParams(standing_update=0.5)


class GraphSlamNode(MapperNode):
    """Maps with submaps and a pose graph. After a restart it builds the map again that the map recorder has kept."""

    live_params = ("*.*_update", "*.clear_range", "*_noise*")
    params: GraphSlamNodeParams
    restored_folder: In[String] = restored("map_recorder/folder")

    def reconfigure(self, params: GraphSlamNodeParams) -> None:
        """Apply new parameters from the next scan on."""
        self.params = params
        if isinstance(self._slam, GraphSlam):
            self._slam.retune(self.settings())

    def settings(self) -> GraphSlamParams:
        """Return the parameters with the usable maximum range of the robot's sensor."""
        params = self.params.graph
        max_range = min(params.max_range, usable_range(self.robot, params.resolution))
        return msgspec.structs.replace(params, max_range=max_range)

    def new_slam(self, settings: GraphSlamParams, laser: SE2, initial: SE2) -> GraphSlam:
        """Return a graph without submaps."""
        return GraphSlam(settings, laser, initial)

    def restarted_slam(self, _laser: SE2, start: SE2) -> Slam | None:
        """Return a graph of the scans that the map recorder has kept, up to 20 s before the restart."""
        if self.restored_folder.last is None:
            return None
        slam = ContinuedMap(Path(self.restored_folder.last.data)).slam
        slam.relocate(start, START_STD_XY, START_STD_YAW)
        return slam
