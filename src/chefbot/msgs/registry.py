"""Message classes by their ROS name."""

from __future__ import annotations

import importlib
from functools import cache

from chefbot.msgs.base import Message


@cache
def message_type(name: str) -> type[Message]:
    """The class of 'sensor_msgs/msg/LaserScan'. KeyError when there is none."""
    package, _, rest = name.partition("/")
    try:
        found = getattr(importlib.import_module(f"chefbot.msgs.{package}"), rest.rpartition("/")[2])
    except (ImportError, AttributeError):
        raise KeyError(f"no message type is called {name}") from None
    if not (isinstance(found, type) and issubclass(found, Message)):
        raise KeyError(f"{name} is no message type")
    return found
