"""Noise of a motion measured by odometry, as the motion models of mapping and localization sample it."""

from __future__ import annotations

from typing import Annotated, ClassVar

import msgspec
from msgspec import Meta


class OdometryNoise(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Standard deviations of odometry errors per metre of translation and per radian of rotation.

    Each motion model states how it combines them: gmapping adds the deviations, AMCL the variances. All four
    are given together, as they belong to one robot on one floor.
    """

    translation_from_translation: Annotated[
        float, Meta(ge=0.0, le=2.0, description="translation error due to translation, m per m")
    ]
    translation_from_rotation: Annotated[
        float, Meta(ge=0.0, le=2.0, description="translation error due to rotation, m per rad")
    ]
    rotation_from_translation: Annotated[
        float, Meta(ge=0.0, le=5.0, description="rotation error due to translation, rad per m")
    ]
    rotation_from_rotation: Annotated[
        float, Meta(ge=0.0, le=2.0, description="rotation error due to rotation, rad per rad")
    ]

    ROS_KEYS: ClassVar[dict[str, tuple[str, str]]] = {
        "srr": ("translation_from_translation", "gmapping's srr"),
        "str": ("translation_from_rotation", "gmapping's str, as its code uses it"),
        "srt": ("rotation_from_translation", "gmapping's srt, as its code uses it"),
        "stt": ("rotation_from_rotation", "gmapping's stt"),
        "alpha1": ("rotation_from_rotation", "the square root of AMCL's alpha1"),
        "alpha2": ("rotation_from_translation", "the square root of AMCL's alpha2"),
        "alpha3": ("translation_from_translation", "the square root of AMCL's alpha3"),
        "alpha4": ("translation_from_rotation", "the square root of AMCL's alpha4"),
    }
    """Key of a ROS package to the field here and what that field is in its terms.

    gmapping's documentation describes srt and str the other way round than openslam_gmapping's motionmodel.cpp
    samples them: str is multiplied by the rotation and blurs the translation. Nav2's AMCL adds variances:
    alpha1 rot^2 + alpha2 trans^2.
    """
