"""What the commands for a running robot share: they use its web UI."""

from __future__ import annotations

import math
from collections.abc import Collection

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.place_names import with_labels
from chefbot.storage.places import find_place
from chefbot.ui.remote.web_ui_client import WebUiClient

RESPONSE_TIMEOUT = 10.0
"""Timeout of a layer, s: a robot that has just started makes its first map within a few seconds."""
REFUSAL_TIMEOUT = 0.5
"""Time for which a refusal of a command is awaited, s."""
LAYER_TIMEOUT = 1.0
"""Timeout of a layer that not every robot has, s: it is sent with the first frames or not at all."""

ADD_PLACES = "store where it is as one with `chefbot drive place NAME`"
"""What to do on a map without named places, as part of a sentence about the robot."""


def known_places(robot: WebUiClient) -> dict[str, SE2]:
    """Return the robot's named places with their poses in the map frame; empty if it has none."""
    shown = robot.wait_for("places", LAYER_TIMEOUT) or []
    return {place["name"]: SE2(place["x"], place["y"], place["yaw"]) for place in shown}


def pose_text(pose: SE2) -> str:
    """Return a pose in the map frame for people: '(1.50, 0.50) m, 90 degrees'."""
    return f"({pose.x:.2f}, {pose.y:.2f}) m, {round(math.degrees(pose.yaw))} degrees"


def find_shown_place(robot: WebUiClient, query: str, places: Collection[str]) -> str:
    """Return the place that a name, a number or a label refers to. Raises UserError with the closest name."""
    return find_place(query, places, robot.wait_for("labels", LAYER_TIMEOUT) or {})


def with_shown_labels(robot: WebUiClient, text: str) -> str:
    """Return a sentence of the robot with the labels of the places that it names."""
    return with_labels(text, robot.latest.get("labels") or {})


def failed_goals(robot: WebUiClient) -> int:
    """Return the number of goals that have failed since the robot's start."""
    status = robot.wait_for("status", LAYER_TIMEOUT)
    return status["failures"] if status else 0


def await_failure(robot: WebUiClient, failed_before: int) -> None:
    """Receive as in `await_refusal`, and raise UserError with the reason as soon as another goal has failed."""

    def has_failed() -> bool:
        status = robot.latest["status"]
        return status is not None and status["failures"] > failed_before

    if robot.wait_until(has_failed, REFUSAL_TIMEOUT):
        raise UserError(robot.latest["status"]["reason"] or "the goal has failed")


def await_refusal(robot: WebUiClient) -> None:
    """Receive for a while, so that a refusal of the last command raises its UserError."""
    robot.wait_until(lambda: False, REFUSAL_TIMEOUT)
