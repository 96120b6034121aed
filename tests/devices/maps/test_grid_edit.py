"""Changes of the map itself: in their order, and places and zones that turn with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.devices.maps.grid_edit import changes_grid, edited_grid, turned_entry, turned_zone
from chefbot.maths.grid import FREE, OCCUPIED, Grid
from chefbot.msgs.chefbot_msgs.maps import MapEdit, MapStroke, MapZone
from chefbot.msgs.geometry_msgs import Point
from chefbot.storage.places import PlaceEntry

ANGLES = st.floats(-math.pi, math.pi)


def test_strokes_are_drawn_in_their_order_before_the_crop() -> None:
    grid = Grid(np.full((40, 40), FREE, np.int8), 0.05, 0.0, 0.0)
    line = (Point(0.0, 1.0, 0.0), Point(2.0, 1.0, 0.0))
    strokes = (MapStroke(line, 0.2, OCCUPIED), MapStroke(line[:1], 0.4, FREE))
    edit = MapEdit(strokes=strokes, crop=(Point(2.0, 2.0, 0.0), Point(0.0, 0.5, 0.0)))
    assert changes_grid(edit) and not changes_grid(MapEdit("a", deleted_places=("bar",)))
    edited = edited_grid(grid, edit)
    assert edited.origin_y == pytest.approx(0.5) and edited.height == 30
    assert (edited.at(0.1, 1.0), edited.at(1.0, 1.0), edited.at(1.0, 1.3)) == (FREE, OCCUPIED, FREE)


@given(ANGLES, ANGLES, st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_turning_there_and_back_changes_nothing(yaw: float, direction: float, x: float, y: float) -> None:
    place = PlaceEntry(x=x, y=y, yaw=direction, label="Café")
    back = turned_entry(turned_entry(place, yaw), -yaw)
    assert (back.x, back.y, back.label) == (pytest.approx(x, abs=1e-9), pytest.approx(y, abs=1e-9), "Café")
    assert math.remainder(back.yaw - direction, math.tau) == pytest.approx(0.0, abs=1e-9)
    zone = MapZone(
        "lane", "one_way", (Point(x, y, 0.0), Point(x + 1, y, 0.0), Point(x, y + 1, 0.0)), 0.0, direction
    )
    same = turned_zone(turned_zone(zone, yaw), -yaw)
    assert same.array == pytest.approx(zone.array, abs=1e-9)
    assert math.remainder(same.direction - direction, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_zone_without_a_direction_keeps_none() -> None:
    zone = MapZone("stairs", "keep_out", (Point(1.0, 0.0, 0.0), Point(2.0, 0.0, 0.0), Point(1.0, 1.0, 0.0)))
    assert turned_zone(zone, 0.5).direction == 0.0
