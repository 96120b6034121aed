"""Which wire a program of this user means, from the environment as ROS 2's own tools take it."""

from __future__ import annotations

import os

from chefbot.errors import UserError
from chefbot.ros2.rmw.session import MAX_DOMAIN, PORT

DOMAIN_VARIABLE, PORT_VARIABLE = "ROS_DOMAIN_ID", "CHEFBOT_WIRE_PORT"


def domain_of_environment() -> int:
    """ROS_DOMAIN_ID, else 0. UserError when it is no domain."""
    return _number(DOMAIN_VARIABLE, 0, MAX_DOMAIN, 0)


def port_of_environment() -> int:
    """CHEFBOT_WIRE_PORT, for several wires on one machine; else rmw_zenoh's 7447."""
    return _number(PORT_VARIABLE, 1, 65535, PORT)


def _number(variable: str, least: int, most: int, default: int) -> int:
    text = os.environ.get(variable, "").strip()
    if not text:
        return default
    if not (text.isascii() and text.isdigit() and least <= int(text) <= most):
        raise UserError(f"the environment's {variable}={text} must be a number between {least} and {most}")
    return int(text)
