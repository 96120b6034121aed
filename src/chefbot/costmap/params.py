"""Parameters of a costmap; the robot's radius comes from the Robot."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

LIVE_PARAMS = ("padding", "inflation_radius", "cost_scaling_factor", "marking_range", "clearing_range")
"""Parameters that `LayeredCostmap.retune` can change while the obstacle layers are kept."""


class CostmapParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of a layered costmap `LayeredCostmap`."""

    resolution: Annotated[
        float, Meta(ge=0.01, le=0.5, description="side of a cell of a rolling window, m")
    ] = 0.05
    size: Annotated[float, Meta(ge=1.0, le=50.0, description="side of a rolling window, m")] = 4.0
    padding: Annotated[float, Meta(ge=0.0, le=0.5, description="kept free around the robot, m")] = 0.02
    inflation_radius: Annotated[
        float, Meta(ge=0.0, le=5.0, description="how far from an obstacle costs reach, m")
    ] = 0.55
    cost_scaling_factor: Annotated[
        float, Meta(ge=0.1, le=100.0, description="how fast costs fall with distance, 1/m")
    ] = 5.0
    marking_range: Annotated[
        float, Meta(ge=0.1, le=100.0, description="returns further than this mark no obstacle, m")
    ] = 3.5
    clearing_range: Annotated[
        float, Meta(ge=0.1, le=100.0, description="beams clear up to this range, m")
    ] = 4.0
    occupied_threshold: Annotated[
        int, Meta(ge=1, le=100, description="a map cell this occupied is an obstacle, percent")
    ] = 65
    track_unknown: Annotated[
        bool, Meta(description="whether cells that nothing has seen are unknown instead of free")
    ] = True
