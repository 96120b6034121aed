"""What the commands for a running robot share: they use its web UI."""

from __future__ import annotations

from chefbot.maths.se2 import SE2
from chefbot.ui.remote.web_ui_client import WebUiClient

RESPONSE_TIMEOUT = 10.0
"""Timeout of a layer, s: a robot that has just started makes its first map within a few seconds."""
REFUSAL_TIMEOUT = 0.5
"""Time for which a refusal of a command is awaited, s."""
LAYER_TIMEOUT = 1.0
"""Timeout of a layer that not every robot has, s: it is sent with the first frames or not at all."""


def known_places(robot: WebUiClient) -> dict[str, SE2]:
    """Return the robot's named places with their poses in the map frame; empty if it has none."""
    shown = robot.wait_for("places", LAYER_TIMEOUT) or []
    return {place["name"]: SE2(place["x"], place["y"], place["yaw"]) for place in shown}


def await_refusal(robot: WebUiClient) -> None:
    """Receive for a while, so that a refusal of the last command raises its UserError."""
    robot.wait_until(lambda: False, REFUSAL_TIMEOUT)
