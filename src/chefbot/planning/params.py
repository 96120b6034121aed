"""Parameters of the global planner."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class PlannerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the built-in planner `GridPlanner`."""

    allow_unknown: Annotated[
        bool, Meta(description="whether paths may cross cells that nothing has seen")
    ] = False
    tolerance: Annotated[
        float, Meta(ge=0.0, le=5.0, description="a blocked goal may be replaced by a place this near, m")
    ] = 0.5
    escape: Annotated[
        float,
        Meta(ge=0.0, le=1.0, description="a start too near an obstacle may reach this far to get out, m"),
    ] = 0.3
    cost_weight: Annotated[
        float,
        Meta(ge=0.0, le=100.0, description="driving at cost 252 is dearer than in the free by this factor"),
    ] = 3.0
    unknown_weight: Annotated[
        float,
        Meta(ge=0.0, le=100.0, description="driving in the unknown is dearer by this factor, if allowed"),
    ] = 1.0
    spacing: Annotated[
        float, Meta(ge=0.01, le=0.5, description="distance between the poses of a path, m")
    ] = 0.05
    smooth: Annotated[
        bool,
        Meta(description="whether the path is pulled straight instead of going from cell to cell"),
    ] = True
