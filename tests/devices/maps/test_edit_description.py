"""Tests that a change of the map is described for the person who may undo it."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.devices.maps.edit_description import edit_description
from chefbot.devices.maps.map_content import MapChange, MapContent
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, MapEdit, MapStroke, MapZone
from chefbot.msgs.geometry_msgs import Point
from chefbot.storage.places import PlaceEntry

GRID = Grid(np.zeros((10, 10), np.int8), 0.1, 0.0, 0.0)
TABLE = PlaceEntry(x=1.0, y=2.0, label="Window")
PLACES = {"table_1": TABLE, "table_2": PlaceEntry(x=3.0, y=2.0)}
STAIRS = MapZone("stairs", KEEP_OUT, tuple(Point(x, y, 0.0) for x, y in ((0, 0), (1, 0), (1, 1))))
BEFORE = MapContent(PLACES, (STAIRS,), GRID)


def described(after: MapContent) -> str:
    return edit_description(MapEdit("a"), MapChange(BEFORE, after))


@pytest.mark.parametrize(
    ("places", "sentence"),
    [
        ({**PLACES, "bar": TABLE}, "Window was added"),
        ({"table_1": TABLE}, "table 2 was removed"),
        ({**PLACES, "table_1": msgspec.structs.replace(TABLE, yaw=1.0)}, "Window was moved"),
        ({**PLACES, "table_1": msgspec.structs.replace(TABLE, label="Door")}, "Window was renamed Door"),
        ({**PLACES, "a": TABLE, "table_2": TABLE}, "Window was added; table 2 was moved"),
        ({}, "Window was removed; table 2 was removed"),
        ({**PLACES, "a": TABLE, "b": TABLE, "c": TABLE, "d": TABLE}, "4 places and zones were changed"),
    ],
)
def test_changed_places_are_named(places: dict[str, PlaceEntry], sentence: str) -> None:
    after = described(BEFORE._replace(places=places))
    assert sorted(after.split("; ")) == sorted(sentence.split("; "))


def test_changed_zones_are_named() -> None:
    wider = msgspec.structs.replace(STAIRS, corners=(*STAIRS.corners, Point(0.0, 1.0, 0.0)))
    assert described(BEFORE._replace(zones=(wider,))) == "keep-out zone stairs was changed"
    assert described(BEFORE._replace(zones=())) == "keep-out zone stairs was removed"
    lane = msgspec.structs.replace(STAIRS, name="keep_out_1")
    assert described(BEFORE._replace(zones=(STAIRS, lane))) == "keep-out zone 1 was added"


def test_changes_of_the_map_itself_are_described() -> None:
    change, point = MapChange(BEFORE, BEFORE), Point(0.0, 0.0, 0.0)
    edits = {
        "The map was rotated by -30°": MapEdit("a", rotation=-math.pi / 6),
        "The map was cropped": MapEdit("a", crop=(point, point)),
        "The map was drawn on": MapEdit("a", strokes=(MapStroke((point,), 0.1, 100),)),
    }
    for sentence, edit in edits.items():
        assert edit_description(edit, change) == sentence
