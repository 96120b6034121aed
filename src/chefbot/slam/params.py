"""Parameters of the SLAM node and algorithm."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.odometry_noise import OdometryNoise

MATCH_RANGE = 40.0
"""Range in metres of the returns that are registered with those of other scans, unless another one is given."""


class GmappingParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of `Gmapping`; the defaults suit lasers of 180 to 360 degrees and depth cameras indoors."""

    particles: Annotated[
        int, Meta(ge=1, le=1000, description="number of particles, each with its own map")
    ] = 30
    resolution: Annotated[float, Meta(ge=0.01, le=0.5, description="side of a map cell, m")] = 0.05
    linear_update: Annotated[
        float, Meta(ge=0.0, le=10.0, description="a scan is processed after this much travel, m")
    ] = 0.5
    angular_update: Annotated[
        float, Meta(ge=0.0, le=3.15, description="a scan is processed after this much rotation, rad")
    ] = 0.4
    standing_update: Annotated[
        float,
        Meta(
            ge=0.05,
            le=1.0,
            description="share of these two that is enough where the robot stands, as at a goal",
        ),
    ] = 1.0
    max_range: Annotated[
        float, Meta(gt=0.0, le=200.0, description="returns further than this mark no cell, m")
    ] = 80.0
    match_range: Annotated[
        float,
        Meta(
            gt=0.0, le=200.0, description="returns farther than this are not used in the joint adjustment, m"
        ),
    ] = MATCH_RANGE
    clear_range: Annotated[
        float, Meta(ge=0.0, le=200.0, description="a beam without return clears the map up to here, m")
    ] = 3.0
    sigma: Annotated[
        float,
        Meta(ge=0.005, le=1.0, description="standard deviation of a beam's end about a mapped surface, m"),
    ] = 0.05
    iterations: Annotated[
        int, Meta(ge=1, le=10, description="how often the matcher halves its last steps")
    ] = 4
    odometry_noise: OdometryNoise = OdometryNoise(
        translation_from_translation=0.1,
        translation_from_rotation=0.1,
        rotation_from_translation=0.2,
        rotation_from_rotation=0.2,
    )
    min_translation_noise: Annotated[
        float,
        Meta(ge=0.0001, le=0.1, description="minimum odometry noise per step, m (standard deviation)"),
    ] = 0.01
    min_rotation_noise: Annotated[
        float, Meta(ge=0.0001, le=0.1, description="minimum heading noise per step, rad")
    ] = 0.01
    independent_beams: Annotated[
        float,
        Meta(ge=1.0, le=1000.0, description="maximum number of independent beams that a scan counts as"),
    ] = 30.0
    resample_threshold: Annotated[
        float,
        Meta(ge=0.0, le=1.0, description="resample when fewer than this share of particles is effective"),
    ] = 0.5
    max_cells: Annotated[
        int,
        Meta(ge=10_000, le=1_000_000_000, description="maximum number of cells of the map's rectangle"),
    ] = 64_000_000
    seed: Annotated[int, Meta(ge=0, description="random seed; the same seed gives the same map")] = 1
