"""Parameters of the Dynamic Window Approach."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class DwaParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of `Dwa`; velocity and acceleration limits come from the Robot."""

    period: Annotated[float, Meta(ge=0.01, le=1.0, description="time between two commands, s")] = 0.1
    sim_time: Annotated[
        float, Meta(ge=0.3, le=5.0, description="how far a trajectory is looked ahead, s")
    ] = 1.5
    v_samples: Annotated[int, Meta(ge=2, le=100, description="forward speeds tried per command")] = 9
    w_samples: Annotated[int, Meta(ge=3, le=200, description="turn rates tried per command")] = 31
    path_weight: Annotated[float, Meta(ge=0.0, le=100.0, description="price of a metre off the path")] = 6.0
    goal_weight: Annotated[float, Meta(ge=0.0, le=100.0, description="worth of a metre along the path")] = 3.0
    heading_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="price of a radian that the path is not looked along")
    ] = 0.5
    obstacle_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="price of a trajectory that touches cost 252")
    ] = 1.0
    change_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="price of a change of turn by 1 rad/s, for calm")
    ] = 0.1
    slowing: Annotated[
        float, Meta(ge=0.0, le=0.95, description="share of the speed that is given up right beside obstacles")
    ] = 0.6
    rotate_from: Annotated[
        float, Meta(ge=0.2, le=3.15, description="turns in place when the path is this far off, rad")
    ] = 0.9
