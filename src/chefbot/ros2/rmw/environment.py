"""ROS domain and router port from the environment variables that ROS 2 tools use."""

from __future__ import annotations

import os

from chefbot.ros2.rmw.errors import SessionError
from chefbot.ros2.rmw.session import MAX_DOMAIN, PORT

DOMAIN_VARIABLE, PORT_VARIABLE = "ROS_DOMAIN_ID", "CHEFBOT_WIRE_PORT"


def domain_from_environment() -> int:
    """Return ROS_DOMAIN_ID, or 0 if unset; raises SessionError when it is not a valid domain."""
    return _number(DOMAIN_VARIABLE, 0, MAX_DOMAIN, 0)


def port_from_environment() -> int:
    """Return the router port: CHEFBOT_WIRE_PORT, else rmw_zenoh's 7447.

    The variable allows several separate networks on one machine.
    """
    return _number(PORT_VARIABLE, 1, 65535, PORT)


def _number(variable: str, minimum: int, maximum: int, default: int) -> int:
    text = os.environ.get(variable, "").strip()
    if not text:
        return default
    if not (text.isascii() and text.isdigit() and minimum <= int(text) <= maximum):
        raise SessionError(
            f"the environment's {variable}={text} must be a number between {minimum} and {maximum}"
        )
    return int(text)
