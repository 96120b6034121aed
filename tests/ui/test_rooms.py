"""Tests in Chromium of the rooms that the web UI finds in a map."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid

pytestmark = [pytest.mark.slow, needs_chromium]
RESOLUTION = 0.05
ROOMS = """(async (grid) => {
  const { findRooms } = await import('./rooms.js');
  const rooms = findRooms(grid, (value) => value >= 0 && value < 25, (value) => value >= 65);
  return JSON.stringify(rooms && { width: rooms.width, count: rooms.count, cells: [...rooms.cells] });
})(%s)"""


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    from tests.ui.conftest import Page

    page = Page()
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as opened:
        yield opened
    page.server.stop()


def rooms_in(tab: Tab, cells: np.ndarray) -> Any:
    """Return the number of rooms with the tint of each cell of 0.1 m, None for fewer than two rooms."""
    grid = {"width": cells.shape[1], "height": cells.shape[0], "resolution": RESOLUTION, "x": 0, "y": 0}
    found = json.loads(tab.evaluate(ROOMS % json.dumps({**grid, "cells": cells.ravel().tolist()})))
    return found and (found["count"], np.array(found["cells"]).reshape(-1, found["width"]))


def row_of_rooms(count: int, door: float, *, furniture: bool = False) -> np.ndarray:
    """Return a map of rooms of 4 m x 5 m in a row, each with a door (m) to the next one."""
    cells = np.full((100, 80 * count), FREE, np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = (OCCUPIED,) * 4
    for wall in range(80, 80 * count, 80):
        cells[:, wall : wall + 2] = OCCUPIED
        cells[50 : 50 + round(door / RESOLUTION), wall : wall + 2] = FREE
    if furniture:  # the legs of tables, and a closed box
        cells[20:80:12, 20:-20:16] = OCCUPIED
        cells[5:20, 8:30] = UNKNOWN
        cells[[5, 19], 8:30], cells[5:20, [8, 29]] = OCCUPIED, OCCUPIED
    return cells


@pytest.mark.parametrize("furniture", [False, True])
@pytest.mark.parametrize("door", [0.8, 1.2])
def test_doors_divide_rooms_and_furniture_does_not(tab: Tab, door: float, furniture: bool) -> None:
    count, tints = rooms_in(tab, row_of_rooms(4, door, furniture=furniture))
    assert count == 4
    middles = [tints[45, 20 + 40 * room] for room in range(4)]
    assert all(middles) and all(a != b for a, b in itertools.pairwise(middles))


def test_labels_find_the_room_of_a_point(page: Any) -> None:
    page.server.set_layer("map", Grid(row_of_rooms(2, 1.0), RESOLUTION, -1.0, -2.0))
    tints = "[[2, 0], [5, 0], [20, 0], [2, -9], [2, 90]].map(([x, y]) => tint({ x, y }))"
    found = f"import('./grids.js').then(({{ roomTint: tint }}) => {tints})"
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"{found}.then(([room]) => room > 0)")
        first, second, *outside = tab.evaluate(found)
    assert first != second > 0 and outside == [0, 0, 0]


def test_one_room_or_an_empty_map_has_no_tint(tab: Tab) -> None:
    assert rooms_in(tab, row_of_rooms(1, 1.0)) is None
    assert rooms_in(tab, row_of_rooms(3, 3.0)) is None  # a wide opening is no door
    assert rooms_in(tab, np.full((30, 40), UNKNOWN, np.int8)) is None
    assert rooms_in(tab, np.full((1, 1), FREE, np.int8)) is None
