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
    spin: Annotated[float, Meta(ge=0.1, le=12.6, description="how far to rotate, rad")] = 2.0 * math.pi
    wait: Annotated[float, Meta(ge=0.1, le=600.0, description="how long to wait, s")] = 5.0
    clear_radius: Annotated[
        float, Meta(ge=0.1, le=20.0, description="radius within which marked obstacles are cleared, m")
    ] = 2.0
    rounds: Annotated[
        int, Meta(ge=1, le=100, description="rounds of recovery behaviors before giving up")
    ] = 2


class WaitingParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of waiting for people and other obstacles that may go away."""

    patience: Annotated[
        float, Meta(ge=0.0, le=86_400, description="how long to wait where there is no other path, s")
    ] = 300.0
    typical_stay: Annotated[
        float, Meta(ge=1.0, le=600, description="expected stay of a person who has just stopped, s")
    ] = 10.0
    at_goal: Annotated[
        float, Meta(ge=0.0, le=600, description="how long to wait near a goal for it to become free, s")
    ] = 5.0
    request_after: Annotated[
        float, Meta(ge=0.0, le=600, description="how long to wait before requesting to pass, s")
    ] = 3.0
    request_period: Annotated[float, Meta(ge=1.0, le=600, description="time between two requests, s")] = 15.0
    request: Annotated[str, Meta(max_length=200, description="request to pass, as speech; empty: none")] = (
        "May I pass, please?"
    )


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
    waiting: WaitingParams = WaitingParams()
