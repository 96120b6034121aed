"""Parameters of a costmap; the robot's radius comes from the Robot."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

LIVE_PARAMS = ("padding", "inflation_radius", "cost_scaling_factor", "marking_range", "clearing_range")
"""Parameters that `LayeredCostmap.reconfigure` can change while the obstacle layers are kept."""


LAYERS = (
    "chefbot.costmap.layers:StaticLayer",
    "chefbot.costmap.layers:ObstacleLayer",
    "chefbot.costmap.glass_layer:GlassLayer",
    "chefbot.costmap.layers:RangeSensorLayer",
    "chefbot.costmap.zone_layers:KeepOutLayer",
    "chefbot.costmap.layers:InflationLayer",
    "chefbot.costmap.zone_layers:PreferredLayer",
    "chefbot.costmap.zone_layers:OneWayLayer",
)
"""Layers of the planner's costmap, in order."""


class CostmapParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of a layered costmap `LayeredCostmap`."""

    resolution: Annotated[
        float, Meta(ge=0.01, le=0.5, description="side of a cell of a rolling window, m")
    ] = 0.05
    size: Annotated[float, Meta(ge=1.0, le=50.0, description="side of a rolling window, m")] = 4.0
    padding: Annotated[float, Meta(ge=0.0, le=0.5, description="footprint padding, m")] = 0.02
    inflation_radius: Annotated[float, Meta(ge=0.0, le=5.0, description="inflation radius, m")] = 0.55
    cost_scaling_factor: Annotated[
        float, Meta(ge=0.1, le=100.0, description="exponential decay of the cost with distance, 1/m")
    ] = 5.0
    marking_range: Annotated[float, Meta(ge=0.1, le=100.0, description="maximum range of marking, m")] = 3.5
    clearing_range: Annotated[float, Meta(ge=0.1, le=100.0, description="maximum range of clearing, m")] = 4.0
    occupied_threshold: Annotated[
        int, Meta(ge=1, le=100, description="occupancy from which a map cell is lethal, percent")
    ] = 65
    track_unknown: Annotated[
        bool, Meta(description="whether unobserved cells are unknown instead of free")
    ] = True
    decay_time: Annotated[
        float, Meta(ge=0.0, le=86400.0, description="time after which an unconfirmed mark goes, s; 0: never")
    ] = 0.0
    layers: tuple[str, ...] = LAYERS
    """`pkg.module:Class` of each layer in order, the lowest first; its constructor receives LayerSettings."""


GLOBAL_COSTMAP = CostmapParams(decay_time=60.0)
"""The planner's costmap: of what is near enough to be seen it forgets what the local costmap forgets."""
LOCAL_COSTMAP = CostmapParams(track_unknown=False, decay_time=60.0, layers=LAYERS[:6])
"""The local costmap: unknown space is free, because a camera sees little at once; the planner has the map. A mark
lasts as long as the collision monitor remembers a measurement: the two must agree on what is in the way."""
