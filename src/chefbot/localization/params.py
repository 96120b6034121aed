"""Parameters of the localization."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.odometry_noise import OdometryNoise


class AmclParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of `Amcl`, with Nav2's names where the concept is the same."""

    min_particles: Annotated[int, Meta(ge=10, le=1_000_000, description="minimum number of particles")] = 1000
    max_particles: Annotated[
        int, Meta(ge=10, le=1_000_000, description="maximum number of particles after resampling")
    ] = 20_000
    odometry_noise: OdometryNoise = OdometryNoise(
        translation_from_translation=0.1,
        translation_from_rotation=0.05,
        rotation_from_translation=0.05,
        rotation_from_rotation=0.05,
    )
    z_hit: Annotated[
        float, Meta(gt=0.0, le=1.0, description="share of the beams that end on something mapped")
    ] = 0.9
    z_rand: Annotated[
        float, Meta(gt=0.0, le=1.0, description="share of the beams that end anywhere: people, noise")
    ] = 0.1
    sigma_hit: Annotated[
        float,
        Meta(ge=0.01, le=2.0, description="standard deviation of a beam's end about a mapped surface, m"),
    ] = 0.1
    laser_likelihood_max_dist: Annotated[
        float,
        Meta(ge=0.1, le=10.0, description="a beam's end further from all obstacles counts as this far, m"),
    ] = 2.0
    max_beams: Annotated[
        int, Meta(ge=3, le=10_000, description="beams of a scan that weigh the particles")
    ] = 60
    beam_independence: Annotated[
        float,
        Meta(
            ge=0.0,
            le=1.6,
            description="beams within this angle share the same map error and count as one, rad",
        ),
    ] = 0.1
    update_min_d: Annotated[
        float,
        Meta(
            ge=0.0,
            le=0.4,
            description="the filter updates after this much travel, m; without an update over 0.5 m the robot stands",
        ),
    ] = 0.1
    update_min_a: Annotated[
        float, Meta(ge=0.0, le=3.2, description="the filter updates after this much rotation, rad")
    ] = 0.1
    pf_err: Annotated[
        float, Meta(gt=0.0, le=1.0, description="KLD sampling: maximum divergence from the true posterior")
    ] = 0.05
    pf_z: Annotated[
        float, Meta(ge=0.0, le=5.0, description="KLD sampling: normal quantile of the certainty of pf_err")
    ] = 2.33
    recovery_alpha_slow: Annotated[
        float, Meta(ge=0.0, le=1.0, description="decay of the slow mean of the likelihood; 0: no recovery")
    ] = 0.02
    recovery_alpha_fast: Annotated[
        float, Meta(ge=0.0, le=1.0, description="decay of the fast mean of the likelihood; 0: no recovery")
    ] = 0.3
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1, description="random seed of the particle filter")] = 0
