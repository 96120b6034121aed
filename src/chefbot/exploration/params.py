"""Parameters of the explorer; the sensor's field of view comes from the Robot."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class ExplorerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of `Explorer`, which users can set."""

    free_threshold: Annotated[
        int, Meta(ge=1, le=100, description="a map cell less occupied than this is free, percent")
    ] = 35
    occupied_threshold: Annotated[
        int, Meta(ge=1, le=100, description="a map cell this occupied stops the view, percent")
    ] = 65
    max_frontier_length: Annotated[
        float, Meta(ge=0.2, le=20.0, description="longer frontiers are split, m")
    ] = 2.0
    view_distance: Annotated[
        float, Meta(ge=0.2, le=10.0, description="maximum distance of a viewpoint from its frontier, m")
    ] = 1.2
    view_range: Annotated[
        float, Meta(ge=0.5, le=20.0, description="unknown floor is counted as gain up to this range, m")
    ] = 3.0
    turn_cost: Annotated[
        float, Meta(ge=0.0, le=10.0, description="cost of turning by one radian, as path length in m")
    ] = 0.3
    fixed_goal_cost: Annotated[
        float, Meta(ge=0.01, le=10.0, description="fixed cost per goal, as path length in m")
    ] = 0.5
    max_attempts: Annotated[
        int, Meta(ge=1, le=100, description="a frontier is given up after so many failed goals")
    ] = 2
    same_goal_distance: Annotated[
        float,
        Meta(ge=0.05, le=5.0, description="goals for frontiers within this distance count as the same, m"),
    ] = 0.5
