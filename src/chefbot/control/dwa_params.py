"""Parameters of the Dynamic Window Approach."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class DwaParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of `DwaController`; velocity and acceleration limits come from the Robot."""

    period: Annotated[float, Meta(ge=0.01, le=1.0, description="control period, s")] = 0.1
    sim_time: Annotated[float, Meta(ge=0.3, le=5.0, description="simulated time of a trajectory, s")] = 1.5
    v_samples: Annotated[int, Meta(ge=2, le=100, description="samples of the forward velocity")] = 9
    w_samples: Annotated[int, Meta(ge=3, le=200, description="samples of the angular velocity")] = 31
    path_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="weight of the cross-track error, 1/m")
    ] = 6.0
    goal_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="weight of progress along the path, 1/m")
    ] = 3.0
    heading_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="weight of the heading error, 1/rad")
    ] = 0.5
    obstacle_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="weight of the mean cost, normalized to 252")
    ] = 1.0
    change_weight: Annotated[
        float, Meta(ge=0.0, le=100.0, description="weight of the change of the angular velocity, s/rad")
    ] = 0.1
    people_weight: Annotated[
        float,
        Meta(ge=0.0, le=100.0, description="weight of the mean cost of people, 0 to 1, over the trajectory"),
    ] = 1.5
    slowing: Annotated[
        float, Meta(ge=0.0, le=0.95, description="fraction by which the speed is reduced next to obstacles")
    ] = 0.6
    people_slowing: Annotated[
        float, Meta(ge=0.0, le=0.95, description="fraction by which the speed is reduced next to people")
    ] = 0.6
    rotate_from: Annotated[
        float,
        Meta(
            ge=0.2,
            le=3.15,
            description="heading error above which the robot rotates in place, rad; at most 0.5 is used if it "
            "senses only what is ahead",
        ),
    ] = 0.9
