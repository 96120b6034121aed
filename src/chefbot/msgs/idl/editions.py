"""Older editions of Nav2's actions, so that clients and servers of other ROS 2 distributions can be used.

The type hash is part of every key expression on the network, so two editions of an action do not match by
themselves. Fields were added: `disable_collision_checks` with Kilted (ros-navigation/navigation2, pull request
4785), `waypoint_statuses` with Kilted, `error_msg` with Kilted and later releases of Jazzy (4459;
docs.ros.org/en/jazzy/p/nav2_msgs has it). Two have another type in Jazzy: poses to navigate through are an array,
and a missed waypoint is a MissedWaypoint.
"""

from __future__ import annotations

import typing
from functools import cache
from typing import Any, TypeVar

from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.idl.action import Action, define_action
from chefbot.msgs.idl.message import Message, define_message
from chefbot.msgs.nav2_msgs import (
    FAILED,
    BackUp,
    ComputePathToPose,
    DriveOnHeading,
    FollowPath,
    FollowWaypoints,
    MissedWaypoint,
    NavigateThroughPoses,
    NavigateToPose,
    Spin,
    WaypointStatus,
)
from chefbot.msgs.nav_msgs import Goals

M = TypeVar("M", bound=Message)
UNKNOWN_TO_JAZZY = ("disable_collision_checks", "waypoint_statuses")
UNKNOWN_TO_EARLY_JAZZY = "error_msg"
"""Field that the results of Nav2 1.3 lack before the middle of 2025."""
NAV2_ACTIONS = (
    *(NavigateToPose, NavigateThroughPoses, FollowWaypoints),
    *(ComputePathToPose, FollowPath, Spin, BackUp, DriveOnHeading),
)
TYPES_IN_JAZZY: dict[Any, Any] = {
    Goals: tuple[PoseStamped, ...],
    tuple[WaypointStatus, ...]: tuple[MissedWaypoint, ...],
}
"""Types of fields that are others in Jazzy; empty tuples are their defaults."""


@cache
def older_editions(name: str) -> tuple[Action[Any, Any, Any], ...]:
    """Return older editions of an action such as 'nav2_msgs/action/Spin', the newest first; mostly none."""
    actions = [action for action in NAV2_ACTIONS if action.ros_name == name]
    jazzy = [_without_fields(action, *UNKNOWN_TO_JAZZY) for action in actions if _differs_in_jazzy(action)]
    return (
        *jazzy,
        *(_without_fields(action, *UNKNOWN_TO_JAZZY, UNKNOWN_TO_EARLY_JAZZY) for action in actions),
    )


def _differs_in_jazzy(action: Action[Any, Any, Any]) -> bool:
    """Return whether Jazzy lacks a field of the action, or has another type for it."""
    parts: tuple[type[Message], ...] = (action.goal, action.result, action.feedback)
    hints = [_hints(part) for part in parts]
    return any(
        name in UNKNOWN_TO_JAZZY or kind in TYPES_IN_JAZZY for part in hints for name, kind in part.items()
    )


def convert(message: Message, kind: type[M]) -> M:
    """Convert a message to another edition: fields it lacks are dropped, additional ones are defaults."""
    if isinstance(message, kind):
        return message
    hints = _hints(kind)
    return kind(
        **{
            name: _converted(getattr(message, name), hints[name])
            for name in _field_names(kind)
            if hasattr(message, name)
        }
    )


def _converted(value: Any, kind: Any) -> Any:
    """Convert the value of a field that has another type in another edition."""
    if isinstance(value, Goals) and kind is not Goals:
        return value.goals
    if kind is Goals and isinstance(value, tuple):
        return Goals(value[0].header, value) if value else Goals()
    if kind == tuple[MissedWaypoint, ...]:
        return tuple(MissedWaypoint(one.waypoint_index, one.waypoint_pose, one.error_code) for one in value)
    if kind == tuple[WaypointStatus, ...] and value and isinstance(value[0], MissedWaypoint):
        return tuple(WaypointStatus(FAILED, one.index, one.goal, one.error_code) for one in value)
    return value


def _without_fields(action: Action[Any, Any, Any], *fields: str) -> Action[Any, Any, Any]:
    return define_action(
        *(_copy_type(part, fields) for part in (action.goal, action.result, action.feedback))
    )


def _copy_type(kind: type[Message], without: tuple[str, ...]) -> type[Message]:
    """Return a separate class with the same ROS name, without some fields and with the types of Jazzy."""
    hints, defaults = _hints(kind), kind()
    fields = [
        (name, TYPES_IN_JAZZY.get(hints[name], hints[name]), _default(hints[name], getattr(defaults, name)))
        for name in _field_names(kind)
        if name not in without
    ]
    return define_message(kind.__name__, fields, __name__, kind.ros_package())


def _default(kind: Any, default: Any) -> Any:
    return () if kind in TYPES_IN_JAZZY else default


@cache
def _hints(kind: type[Message]) -> dict[str, Any]:
    return typing.get_type_hints(kind, include_extras=True)


def _field_names(kind: type[Message]) -> tuple[str, ...]:
    return kind.__struct_fields__
