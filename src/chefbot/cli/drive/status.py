"""`chefbot drive status`: where a running robot is, what it does, what it waits for, and what is wrong."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from rich.console import Console

from chefbot.cli.running_robot import ADD_PLACES, LAYER_TIMEOUT, known_places, pose_text
from chefbot.delivery.status_messages import join_names
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.place_names import display_name, with_labels
from chefbot.ui.remote.web_ui_client import WebUiClient

AT_PLACE_DISTANCE = 0.3
"""Distance from a place at which the robot is there, m."""
STANDSTILL_SPEED = 0.01
"""Speed below which the robot stands, m/s."""
LONG_TIME = 90.0
"""Time from which minutes are printed, s."""
SHOWN_LAYERS = {"status", "robot", "delivery", "forecast", "labels"}
NEARLY_SURE = 0.99
"""Largest probability that is shown: nothing is certain."""
NAME_WIDTH = len("emergency stop")
console = Console(highlight=False, soft_wrap=True, markup=False)


def show_status(page: str) -> int:
    """Print the status of the robot at this address. Returns the exit code: 1 if the emergency stop is active."""
    with WebUiClient(page) as robot:
        places = known_places(robot)
        robot.wait_until(lambda: robot.latest.keys() >= SHOWN_LAYERS, LAYER_TIMEOUT)
        layers = dict(robot.latest)
    status = layers.get("status")
    if status is None:
        raise UserError(f"the robot at {robot.url} does not report its status")
    for name, text in _rows(status, layers, places):
        console.print(f"{name:{NAME_WIDTH}}  {with_labels(text, layers.get('labels') or {})}")
    return 1 if status["stopped"] else 0


def _rows(
    status: dict[str, Any], layers: dict[str, Any], places: dict[str, SE2]
) -> Iterator[tuple[str, str]]:
    if recording := layers.get("playback"):
        yield "recording", f"{recording['title']}, no robot"
    yield "place", place_sentence(layers.get("robot"), places)
    yield "speed", _speed(layers.get("robot"))
    delivery, activity = layers.get("delivery") or {}, status["phase"] or status["navigation"] or "none"
    if activity != delivery.get("step"):
        yield "activity", activity
    yield from _delivery(delivery, layers.get("forecast") or [], places)
    yield "battery", _battery(status)
    yield "localization", _localization(status)
    yield "emergency stop", "active" if status["stopped"] else "not active"
    if status["reason"]:
        yield "last stop", status["reason"]
    for warning in status["warnings"]:
        yield "warning", warning


def _localization(status: dict[str, Any]) -> str:
    probability = status["pose_probability"]
    if probability is None:
        return "unknown"
    return f"{min(probability, NEARLY_SURE):.0%} probable. {status['localization']}".strip()


def _delivery(
    delivery: dict[str, Any], forecast: list[dict[str, Any]], places: dict[str, SE2]
) -> Iterator[tuple[str, str]]:
    step = delivery.get("step")
    yield (
        "delivery",
        f"not possible: no named places; {ADD_PLACES}" if step and not places else step or "none",
    )
    if forecast:
        yield "stops left", "; ".join(map(_stop, forecast))
    elif queue := delivery.get("queue"):
        yield "still to serve", join_names(queue)
    if errands := delivery.get("errands"):
        yield "other goals", join_names(errands)
    for number, order in enumerate(delivery.get("orders", ()), 1):
        yield f"order {number} waits", join_names(order["places"])


def _stop(stop: dict[str, Any]) -> str:
    if not stop["reachable"]:
        return f"{display_name(stop['place'])}: no path on the map"
    time = f"{stop['time']:.0f} s" if stop["time"] < LONG_TIME else f"{stop['time'] / 60:.0f} min"
    charge = "" if stop["battery"] is None else f", {stop['battery']:.0f} % battery"
    return f"{display_name(stop['place'])} in {stop['distance']:.0f} m, about {time}{charge}"


def place_sentence(robot: dict[str, float] | None, places: dict[str, SE2]) -> str:
    """Return where the robot is: by the nearest named place, else by its pose in the map frame."""
    if robot is None:
        return "unknown"
    x, y = robot["x"], robot["y"]
    pose = pose_text(SE2(x, y, robot["yaw"]))
    if not places:
        return pose
    distance, name = min((math.hypot(place.x - x, place.y - y), name) for name, place in places.items())
    if distance < AT_PLACE_DISTANCE:
        return f"at {display_name(name)}; {pose}"
    return f"{distance:.1f} m from {display_name(name)}; {pose}"


def _speed(robot: dict[str, float] | None) -> str:
    if robot is None:
        return "unknown"
    return "0, it stands" if abs(robot["v"]) < STANDSTILL_SPEED else f"{robot['v']:.2f} m/s"


def _battery(status: dict[str, Any]) -> str:
    if status["battery"] is None:
        return "unknown"
    return f"{status['battery']:.0f} %" + ("" if status["volts"] is None else f", {status['volts']:.1f} V")
