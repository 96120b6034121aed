"""Actions that ROS 2's distributions define differently: who speaks an older edition is understood nevertheless.

A type's hash stands in every key of the wire, so two editions of one action never meet by themselves. Fields were
only ever added: `disable_collision_checks` with Kilted (ros-navigation/navigation2, pull request 4785), `error_msg`
with Kilted and later releases of Jazzy (4459; docs.ros.org/en/jazzy/p/nav2_msgs has it).
"""

from __future__ import annotations

import typing
from functools import cache
from typing import Any, TypeVar, cast

import msgspec

from chefbot.msgs.idl.action import Action, define_action
from chefbot.msgs.idl.message import Message
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
"""In results of Nav2 1.3 before the middle of 2025."""
NAV2 = (NavigateToPose, ComputePathToPose, FollowPath, Spin, BackUp, DriveOnHeading)


@cache
def editions(name: str) -> tuple[Action[Any, Any, Any], ...]:
    """Older editions of the action 'nav2_msgs/action/Spin', the newest first; none for most."""
    found = [one for one in NAV2 if one.ros_name == name]
    jazzy = [_without(one, UNKNOWN_TO_JAZZY) for one in found if UNKNOWN_TO_JAZZY in _names(one.goal)]
    return (*jazzy, *(_without(one, UNKNOWN_TO_JAZZY, UNKNOWN_TO_EARLY_JAZZY) for one in found))


def convert(message: Message, kind: type[M]) -> M:
    """The message as another edition has it: what that one lacks is lost, what this one lacks is its default."""
    if isinstance(message, kind):
        return message
    return kind(**{name: getattr(message, name) for name in _names(kind) if hasattr(message, name)})


def _without(action: Action[Any, Any, Any], *fields: str) -> Action[Any, Any, Any]:
    return define_action(*(_copy(one, fields) for one in (action.goal, action.result, action.feedback)))


def _copy(kind: type[Message], without: tuple[str, ...]) -> type[Message]:
    """A class of its own with the same name on the wire."""
    hints = typing.get_type_hints(kind, include_extras=True)
    defaults = kind()
    fields = [(name, hints[name], getattr(defaults, name)) for name in _names(kind) if name not in without]
    package = {"ROS_PACKAGE": kind.ROS_PACKAGE or kind.__module__.rpartition(".")[2]}
    made = msgspec.defstruct(
        kind.__name__, fields, bases=(Message,), module=__name__, namespace=package, frozen=True, eq=False
    )
    return cast(type[Message], made)


def _names(kind: type[Message]) -> tuple[str, ...]:
    return kind.__struct_fields__
