"""Parameters of the navigator and of its recovery behaviors."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

BACK_UP_SPEED_FRACTION = 0.4
"""Fraction of the maximum speed for backing up: the sensors look forward, not back."""
UNRECOVERABLE_ERRORS = (204, 104)
"""Error codes against which no recovery behavior helps; 204: the goal is outside the map (ComputePathToPose), 104:
the timeout while waiting for a sensor or for localization has passed (FollowPath)."""


class RecoveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the recovery behaviors and their number of rounds."""

    back_up: Annotated[float, Meta(ge=0.02, le=1.0, description="how far to back up, m")] = 0.2
    spin: Annotated[float, Meta(ge=0.1, le=12.6, description="how far to turn about, rad")] = 2.0 * math.pi
    wait: Annotated[float, Meta(ge=0.1, le=600.0, description="how long to wait, s")] = 5.0
    clear_radius: Annotated[
        float, Meta(ge=0.1, le=20.0, description="seen obstacles this near are forgotten, m")
    ] = 2.0
    rounds: Annotated[int, Meta(ge=1, le=100, description="times through the order before giving up")] = 2


class NavigatorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the navigator: its behavior tree, replanning and the recovery behaviors."""

    behavior_tree: Annotated[
        str,
        Meta(
            description="file with a behavior tree in the XML of BehaviorTree.CPP 4; empty: the built-in one"
        ),
    ] = ""
    replan_period: Annotated[float, Meta(ge=0.2, le=60, description="replanning period while driving, s")] = (
        1.0
    )
    recovery: RecoveryParams = RecoveryParams()
