"""Parameters of the global planner."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class PlannerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the built-in planner `GridPlanner`."""

    allow_unknown: Annotated[bool, Meta(description="whether paths may cross unknown cells")] = False
    tolerance: Annotated[
        float, Meta(ge=0.0, le=5.0, description="goal tolerance if the goal is occupied, m")
    ] = 0.5
    escape: Annotated[
        float,
        Meta(
            ge=0.0,
            le=1.0,
            description="radius around a start within the inflation that is opened to escape, m",
        ),
    ] = 0.3
    cost_weight: Annotated[
        float,
        Meta(ge=0.0, le=100.0, description="additional cost factor at cost 252 relative to free space"),
    ] = 3.0
    unknown_weight: Annotated[
        float,
        Meta(ge=0.0, le=100.0, description="additional cost factor of unknown cells, if allowed"),
    ] = 1.0
    spacing: Annotated[
        float, Meta(ge=0.01, le=0.5, description="distance between the poses of a path, m")
    ] = 0.05
    smooth: Annotated[
        bool,
        Meta(description="whether the path is smoothed"),
    ] = True
