"""Parameters of graph SLAM."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.slam.params import MATCH_RANGE


class GraphSlamParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of `GraphSlam`; the defaults suit lasers of 180 to 360 degrees in buildings and out of doors."""

    resolution: Annotated[float, Meta(ge=0.01, le=0.5, description="side of a map cell, m")] = 0.05
    linear_update: Annotated[
        float, Meta(ge=0.0, le=10.0, description="a scan is processed after this much travel, m")
    ] = 0.2
    angular_update: Annotated[
        float, Meta(ge=0.0, le=3.15, description="a scan is processed after this much rotation, rad")
    ] = 0.2
    standing_update: Annotated[
        float,
        Meta(
            ge=0.05,
            le=1.0,
            description="share of these two that is enough where the robot stands, as at a goal",
        ),
    ] = 1.0
    max_range: Annotated[
        float, Meta(gt=0.0, le=200.0, description="returns farther than this mark no cell, m")
    ] = 80.0
    clear_range: Annotated[
        float, Meta(ge=0.0, le=200.0, description="a beam without return clears the map up to here, m")
    ] = 3.0
    match_range: Annotated[
        float, Meta(gt=0.0, le=200.0, description="returns farther than this are not matched, m")
    ] = MATCH_RANGE
    odometry_noise: OdometryNoise = OdometryNoise(
        translation_from_translation=0.1,
        translation_from_rotation=0.1,
        rotation_from_translation=0.15,
        rotation_from_rotation=0.15,
    )
    """Noise assumed at the start; it is then scaled to what the scan matches show."""
    min_translation_noise: Annotated[
        float, Meta(ge=0.0001, le=0.1, description="minimum odometry noise per step, m (standard deviation)")
    ] = 0.01
    min_rotation_noise: Annotated[
        float, Meta(ge=0.0001, le=0.1, description="minimum heading noise per step, rad")
    ] = 0.01
    independent_beams: Annotated[
        float,
        Meta(ge=1.0, le=1000.0, description="maximum number of independent beams that a scan counts as"),
    ] = 60.0
    submap_travel: Annotated[
        float, Meta(gt=0.1, le=200.0, description="travel after which the next submap begins, m")
    ] = 12.0
    max_cells: Annotated[
        int,
        Meta(ge=10_000, le=1_000_000_000, description="maximum number of cells of the map's rectangle"),
    ] = 64_000_000
