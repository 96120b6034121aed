"""Kinds of YAML files, recognized by their keys: a file of another kind than expected is named in the error."""

from __future__ import annotations

from pathlib import PurePath
from typing import Any

from chefbot.errors import ChefbotError

ROBOT, WORLD, MAP, ZONES = "robot", "world", "map", "zones"
PLACES, LAUNCH, SCENARIO = "places", "launch", "scenario"
_ROBOT_KEYS = frozenset(
    [
        "like",
        "body",
        "plates",
        "poles",
        "tubes",
        "motor_clamp",
        "wheels",
        "casters",
        "motor",
        "driver",
        "battery",
        "power",
        "drive",
        "equipment",
        "sensors",
        "board",
        "calibration",
    ]
)
_WORLD_KEYS = frozenset(
    [
        "ceiling",
        "walls",
        "tables",
        "chairs",
        "boxes",
        "cylinders",
        "doors",
        "holes",
        "carpets",
        "tags",
        "routes",
        "people",
    ]
)
_MAP_KEYS = frozenset(["image", "mode", "negate", "occupied_thresh", "free_thresh"])
_LAUNCH_KEYS = frozenset(["clock", "args", "include", "nodes", "simulated", "built"])
_SCENARIO_KEYS = frozenset(
    [
        "profile",
        "faults",
        "odometry_error",
        "task",
        "limits",
        "criteria",
        "claim",
        "known_failure",
        "peer",
        "seeds",
    ]
)
KEYS = {
    MAP: _MAP_KEYS,
    ROBOT: _ROBOT_KEYS,
    WORLD: _WORLD_KEYS,
    ZONES: frozenset({"zones"}),
    LAUNCH: _LAUNCH_KEYS,
    SCENARIO: _SCENARIO_KEYS,
    PLACES: frozenset[str](),  # worlds have places, too; a places file has nothing else
}
"""Keys that files of one kind only have."""
PICTURES = (".pgm", ".png")
"""Endings of the picture that belongs to a map."""
_WHAT_IT_IS = {
    ROBOT: "is a robot",
    WORLD: "is a world",
    MAP: "is a map",
    ZONES: "holds the zones of a map",
    LAUNCH: "is a launch",
    SCENARIO: "is a scenario",
    PLACES: "holds the places of a map",
}


def is_kind(data: Any, kind: str) -> bool:
    """Return whether parsed YAML has a key that only files of this kind have."""
    if not isinstance(data, dict):
        return False
    if kind == PLACES:
        return data.keys() == {"places"}
    return not KEYS[kind].isdisjoint(data) or (kind == MAP and {"resolution", "origin"} <= data.keys())


def check_kind(data: Any, expected: str, where: str, error: type[ChefbotError]) -> None:
    """Raise `error` for parsed YAML of another kind than expected; one with any key of its own kind is left alone."""
    if is_kind(data, expected):
        return
    for kind, phrase in _WHAT_IT_IS.items():
        if is_kind(data, kind):
            raise error(f"{where} {phrase}, not a {expected} file")


def check_no_picture(path: PurePath, expected: str, where: str, error: type[ChefbotError]) -> None:
    """Raise `error` for the picture of a map, of which the YAML file is meant."""
    if path.suffix.lower() in PICTURES:
        yaml = path.with_suffix(".yaml").name
        raise error(
            f"{where} is a picture, not a {expected} file; give the YAML file beside it, such as {yaml}"
        )
