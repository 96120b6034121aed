"""A new map replaces maps, but no files of other kinds, and only if a robot can use it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chefbot.errors import UserError
from chefbot.maths.grid import UNKNOWN, Grid
from chefbot.storage.map_files import load_map
from chefbot.storage.new_map import NO_MAP, check_usable, save_new_map

GRID = Grid(np.zeros((5, 5), np.int8), 0.05, 0.0, 0.0)


@pytest.mark.parametrize(
    "content", ["body: {radius: 15 cm}\n", "walls: []\n", "places: {}\n", "- a list\n", "no: [yaml"]
)
def test_files_of_other_kinds_are_not_replaced(tmp_path: Path, content: str) -> None:
    file = tmp_path / "hall.yaml"
    file.write_text(content)
    with pytest.raises(UserError, match=r"hall\.yaml is there already and is not a map; choose another name"):
        save_new_map(tmp_path / "hall", GRID)
    assert file.read_text() == content
    assert [path.name for path in tmp_path.iterdir()] == ["hall.yaml"]


def test_maps_and_empty_files_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "hall.yaml").touch()
    for size in (5, 6):
        path = save_new_map(tmp_path / "hall", Grid(np.zeros((size, size), np.int8), 0.05, 0.0, 0.0))
        assert load_map(path).cells.shape == (size, size)


@pytest.mark.parametrize(
    ("value", "usable"), [(UNKNOWN, False), (50, False), (100, False), (0, True), (19, True)]
)
def test_a_usable_map_has_free_floor(value: int, usable: bool) -> None:
    grid = Grid(np.full((4, 4), value, np.int8), 0.05, 0.0, 0.0)
    if usable:
        check_usable(grid)
    else:
        with pytest.raises(UserError, match=NO_MAP.partition(";")[0]):
            check_usable(grid)
