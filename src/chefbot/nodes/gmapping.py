"""Grid-based FastSLAM, with the interface of slam_gmapping."""

from __future__ import annotations

import msgspec

from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import SE2
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.nodes.scans.mapper import MapperNode, MapperNodeParams
from chefbot.runtime.node import In, restored
from chefbot.scan.usable_range import usable_range
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams

STANDING_UPDATE = 0.2
"""Where a robot stands it maps what it sees from there: an exploration then judges its goals by the map."""
CAMERA = GmappingParams(
    odometry_noise=OdometryNoise(
        translation_from_translation=0.01,
        translation_from_rotation=0.003,
        rotation_from_translation=0.003,
        rotation_from_rotation=0.006,
    ),
    min_translation_noise=0.002,
    min_rotation_noise=0.001,
    standing_update=STANDING_UPDATE,
)
"""Lower odometry noise for a camera: a narrow field of view contains little information about the heading."""


class GmappingNodeParams(MapperNodeParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the mapper for each kind of mapping sensor."""

    lidar: GmappingParams = GmappingParams(standing_update=STANDING_UPDATE)
    camera: GmappingParams = CAMERA


class GmappingNode(MapperNode):
    """Maps with a particle filter. After a restart it continues with the last published map."""

    live_params = ("*.*_update", "*.clear_range", "*_noise*", "*.resample_threshold")
    params: GmappingNodeParams
    restored_map: In[OccupancyGrid] = restored("map")

    def reconfigure(self, params: GmappingNodeParams) -> None:
        """Apply new parameters from the next scan on."""
        self.params = params
        if isinstance(self._slam, Gmapping):
            self._slam.retune(self.settings())

    def settings(self) -> GmappingParams:
        """Return the parameters of the robot's sensor with this run's seed and the usable maximum range."""
        params = self.params.camera if self.robot.sensors.lidar is None else self.params.lidar
        seed = int(self.context.rng().integers(2**31)) + params.seed
        max_range = min(params.max_range, usable_range(self.robot, params.resolution))
        return msgspec.structs.replace(params, seed=seed, max_range=max_range)

    def new_slam(self, settings: GmappingParams, laser: SE2, initial: SE2) -> Gmapping:
        """Return a filter with an empty map."""
        return Gmapping(settings, laser, initial)

    def restarted_slam(self, laser: SE2, start: SE2) -> Gmapping | None:
        """Return a filter with the last published map, which does not hold the scans that it is made of."""
        if self.restored_map.last is None:
            return None
        slam = Gmapping(self.settings(), laser, start)
        slam.resume(self.restored_map.last.grid)
        return slam
