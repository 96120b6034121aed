"""Types by their ROS name."""

from __future__ import annotations

import importlib
from functools import cache
from typing import Any

from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.service import Service


@cache
def message_type(name: str) -> type[Message]:
    """The class of 'sensor_msgs/msg/LaserScan'. KeyError when there is none."""
    found = _find(name)
    if not (isinstance(found, type) and issubclass(found, Message)):
        raise KeyError(f"{name} is no message type")
    return found


@cache
def service_type(name: str) -> Service[Any, Any]:
    """The types of 'std_srvs/srv/SetBool', or of an action's part as '..._SendGoal'. KeyError if unknown."""
    base, _, part = name.rpartition("_")
    if part in ("SendGoal", "GetResult") and "/action/" in name:
        action = action_type(base)
        return action.send_goal_service if part == "SendGoal" else action.get_result_service
    found = _find(name)
    if not isinstance(found, Service):
        raise KeyError(f"{name} is no service type")
    return found


@cache
def action_type(name: str) -> Action[Any, Any, Any]:
    """The types of 'nav2_msgs/action/NavigateToPose'. KeyError when there is none."""
    found = _find(name)
    if not isinstance(found, Action):
        raise KeyError(f"{name} is no action type")
    return found


def _find(name: str) -> Any:
    package, _, rest = name.partition("/")
    try:
        return getattr(importlib.import_module(f"chefbot.msgs.{package}"), rest.rpartition("/")[2])
    except (ImportError, AttributeError):
        raise KeyError(f"no type is called {name}") from None
