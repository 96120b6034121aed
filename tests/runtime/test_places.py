"""Places files: written again without losing the comments that a person put into them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from chefbot.config import ConfigError
from chefbot.maths.se2 import SE2
from chefbot.storage.places import load_entries, load_places, save_places

FILE = """# The ground floor.
places:
  kitchen: {x: 0 m, y: 1 m, yaw: 90 deg}  # beside the door
  # by the window
  table_1:
    x: 250 cm  # measured
    y: 0 m
"""


def test_a_new_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    path, places = tmp_path / "a.places.yaml", {"home": SE2(1.0, -2.5, 0.5 * math.pi)}
    save_places(path, places)
    assert load_places(path) == places
    assert path.read_text().startswith(
        "# Named places on the map beside this file; edit freely.\nplaces:\n  home: {x: "
    )


def test_comments_and_unchanged_places_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.places.yaml"
    path.write_text(FILE)
    places = load_places(path)
    save_places(path, places)
    assert path.read_text() == FILE
    save_places(path, places | {"table_1": SE2(3.0, 0.0, 0.0), "table_2": SE2(1.0, 1.0, 0.0)})
    text = path.read_text()
    assert text.startswith(FILE.split("    x:")[0]) and "    x: 3.000 m # measured\n" in text.replace(
        "  #", " #"
    )
    assert "  table_2: {x: 1.000 m, y: 1.000 m, yaw: 0.0 deg}\n" in text


def test_places_that_are_gone_are_removed(tmp_path: Path) -> None:
    path = tmp_path / "a.places.yaml"
    path.write_text(FILE)
    save_places(path, {"kitchen": SE2(0.0, 1.0, 0.5 * math.pi)})
    assert list(load_places(path)) == ["kitchen"] and "beside the door" in path.read_text()


def test_tolerances_of_a_place_are_read_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.places.yaml"
    path.write_text(
        "places:\n  dock: {x: 1 m, y: 0.2 m, yaw: 0 deg, xy_tolerance: 2 cm, yaw_tolerance: 2 deg}\n"
    )
    save_places(path, {"dock": SE2(2.0, 0.0, 0.0)})
    assert path.read_text().endswith(
        "  dock: {x: 2.000 m, y: 0.000 m, yaw: 0 deg, xy_tolerance: 2 cm, yaw_tolerance: 2 deg}\n"
    )
    dock = load_entries(path)["dock"]
    assert (dock.xy_tolerance, dock.yaw_tolerance) == (0.02, math.radians(2.0))


@pytest.mark.parametrize(
    "key", ["xy_tolerance: 1 mm", "xy_tolerance: 2 deg", "xy_tolerance: .nan m", "yaw_tolerance: wide"]
)
def test_a_wrong_tolerance_has_one_sentence_with_its_key(tmp_path: Path, key: str) -> None:
    path = tmp_path / "a.places.yaml"
    path.write_text(f"places: {{dock: {{x: 1 m, y: 0 m, {key}}}}}\n")
    with pytest.raises(ConfigError, match=rf"places\.dock\.{key.partition(':')[0]}"):
        load_entries(path)
