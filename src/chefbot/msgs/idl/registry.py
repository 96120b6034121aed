"""Lookup of message, service and action types by their ROS name."""

from __future__ import annotations

import importlib
from functools import cache
from typing import Any

from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.service import Service


@cache
def message_type(name: str) -> type[Message]:
    """Return the class of a message type such as 'sensor_msgs/msg/LaserScan'; KeyError if unknown."""
    interface = _find(name)
    if not (isinstance(interface, type) and issubclass(interface, Message)):
        raise KeyError(f"{name} is not a message type")
    return interface


@cache
def service_type(name: str) -> Service[Any, Any]:
    """Return the types of a service such as 'std_srvs/srv/SetBool'; KeyError if unknown.

    The services of an action are interface as '..._SendGoal' and '..._GetResult'.
    """
    base, _, part = name.rpartition("_")
    if part in ("SendGoal", "GetResult") and "/action/" in name:
        action = action_type(base)
        return action.send_goal_service if part == "SendGoal" else action.get_result_service
    interface = _find(name)
    if not isinstance(interface, Service):
        raise KeyError(f"{name} is not a service type")
    return interface


@cache
def action_type(name: str) -> Action[Any, Any, Any]:
    """Return the types of an action such as 'nav2_msgs/action/NavigateToPose'; KeyError if unknown."""
    interface = _find(name)
    if not isinstance(interface, Action):
        raise KeyError(f"{name} is not an action type")
    return interface


def _find(name: str) -> Any:
    package, _, type_path = name.partition("/")
    try:
        return getattr(importlib.import_module(f"chefbot.msgs.{package}"), type_path.rpartition("/")[2])
    except (ImportError, AttributeError):
        raise KeyError(f"no type is called {name}") from None
