"""Older editions of Nav2's actions, so that clients and servers of other ROS 2 distributions can be used.

The type hash is part of every key expression on the network, so two editions of an action do not match by
themselves. Fields were only ever added: `disable_collision_checks` with Kilted (ros-navigation/navigation2,
pull request 4785), `error_msg` with Kilted and later releases of Jazzy (4459;
docs.ros.org/en/jazzy/p/nav2_msgs has it).
"""

from __future__ import annotations

import typing
from functools import cache
from typing import Any, TypeVar

from chefbot.msgs.idl.action import Action, define_action
from chefbot.msgs.idl.message import Message, define_message
from chefbot.msgs.nav2_msgs import (
    BackUp,
    ComputePathToPose,
    DriveOnHeading,
    FollowPath,
    NavigateToPose,
    Spin,
)

M = TypeVar("M", bound=Message)
UNKNOWN_TO_JAZZY = "disable_collision_checks"
UNKNOWN_TO_EARLY_JAZZY = "error_msg"
"""Field that the results of Nav2 1.3 lack before the middle of 2025."""
NAV2_ACTIONS = (NavigateToPose, ComputePathToPose, FollowPath, Spin, BackUp, DriveOnHeading)


@cache
def older_editions(name: str) -> tuple[Action[Any, Any, Any], ...]:
    """Return older editions of an action such as 'nav2_msgs/action/Spin', the newest first; mostly none."""
    actions = [action for action in NAV2_ACTIONS if action.ros_name == name]
    jazzy = [
        _without_fields(action, UNKNOWN_TO_JAZZY)
        for action in actions
        if UNKNOWN_TO_JAZZY in _field_names(action.goal)
    ]
    return (
        *jazzy,
        *(_without_fields(action, UNKNOWN_TO_JAZZY, UNKNOWN_TO_EARLY_JAZZY) for action in actions),
    )


def convert(message: Message, kind: type[M]) -> M:
    """Convert a message to another edition: fields it lacks are dropped, additional ones are defaults."""
    if isinstance(message, kind):
        return message
    return kind(**{name: getattr(message, name) for name in _field_names(kind) if hasattr(message, name)})


def _without_fields(action: Action[Any, Any, Any], *fields: str) -> Action[Any, Any, Any]:
    return define_action(
        *(_copy_type(part, fields) for part in (action.goal, action.result, action.feedback))
    )


def _copy_type(kind: type[Message], without: tuple[str, ...]) -> type[Message]:
    """Return a separate class with the same ROS name, without some fields."""
    hints = typing.get_type_hints(kind, include_extras=True)
    defaults = kind()
    fields = [
        (name, hints[name], getattr(defaults, name)) for name in _field_names(kind) if name not in without
    ]
    package = kind.ROS_PACKAGE or kind.__module__.rpartition(".")[2]
    return define_message(kind.__name__, fields, __name__, package)


def _field_names(kind: type[Message]) -> tuple[str, ...]:
    return kind.__struct_fields__
