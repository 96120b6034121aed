"""Maps changed in the terminal: crop, rotation and undo, with places and zones."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from chefbot.cli.app import main
from chefbot.cli.map.edit import crop_map, print_info, rotate_map, undo_change
from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.storage.map_files import load_map, map_png, save_map
from chefbot.storage.new_map import save_new_map
from chefbot.storage.places import PlaceEntry, load_entries, places_path, save_entries


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A room of 8 x 6 m from (-2, -1) on, with a place."""
    cells = np.zeros((120, 160), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    cells[60, 40:90] = 100
    path = save_map(tmp_path / "room", Grid(cells, 0.05, -2.0, -1.0))
    save_entries(places_path(path), {"kitchen": PlaceEntry(x=1.0, y=0.5, yaw=0.0, label="厨房")})
    return path


def test_a_map_is_described(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    print_info(file)
    text = capsys.readouterr().out
    assert "160 x 120 cells of 0.05 m" in text and "8.00 x 6.00 m from (-2.00, -1.00)" in text
    assert "厨房" in text and "0 changes can be undone" in text


def test_a_part_is_kept_and_taken_back(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = file.with_suffix(".pgm").read_bytes()
    crop_map(file, -1.0, None, None, 3.0)
    grid = load_map(file)
    assert (grid.cells.shape, grid.origin_x, grid.origin_y) == ((80, 140), -1.0, -1.0)
    assert "7.00 x 4.00 m now" in capsys.readouterr().out
    undo_change(file)
    assert file.with_suffix(".pgm").read_bytes() == before
    with pytest.raises(UserError, match="no map change to undo"):
        undo_change(file)


@pytest.mark.parametrize(
    "change", [lambda file: crop_map(file, -50.0, None, None, 50.0), lambda file: rotate_map(file, 360.0)]
)
def test_a_change_that_changes_nothing_makes_no_version(
    file: Path, capsys: pytest.CaptureFixture[str], change: Callable[[Path], None]
) -> None:
    change(file)
    assert "is unchanged" in capsys.readouterr().out
    with pytest.raises(UserError, match="no map change to undo"):
        undo_change(file)


def test_a_folder_stands_for_its_map(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = file.parent
    save_map(folder, load_map(file))
    rotate_map(folder, 90.0)
    print_info(folder)
    assert "120 x 160 cells" in capsys.readouterr().out
    undo_change(folder)
    assert load_map(folder / "map.yaml").cells.shape == (120, 160)


def test_the_picture_beside_a_map_follows_it(file: Path) -> None:
    picture = file.with_suffix(".png")
    picture.write_bytes(map_png(load_map(file)))
    before = picture.read_bytes()
    crop_map(file, -1.0, None, None, None)
    assert picture.read_bytes() == map_png(load_map(file)) != before
    undo_change(file)
    assert picture.read_bytes() == before


def test_a_picture_that_is_the_map_or_a_persons_stays(file: Path) -> None:
    picture = file.with_suffix(".png")
    Image.open(file.with_suffix(".pgm")).save(picture)
    file.with_suffix(".pgm").unlink()
    lines = [
        line for line in file.read_text().replace("room.pgm", "room.png").splitlines() if "sha256" not in line
    ]
    file.write_text("\n".join(lines))
    own, before = picture.read_bytes(), load_map(file).cells
    crop_map(file, -1.0, None, None, None)
    assert picture.read_bytes() == own
    undo_change(file)
    assert picture.read_bytes() == own and np.array_equal(load_map(file).cells, before)


def test_a_new_map_in_place_of_a_changed_one_is_taken_back(file: Path) -> None:
    crop_map(file, -1.0, None, None, None)
    cropped = file.read_bytes(), file.with_suffix(".pgm").read_bytes()
    save_new_map(file, Grid(np.zeros((30, 40), np.int8), 0.05, 0.0, 0.0))
    assert load_map(file).cells.shape == (30, 40)
    undo_change(file)
    assert (file.read_bytes(), file.with_suffix(".pgm").read_bytes()) == cropped
    undo_change(file)
    assert load_map(file).cells.shape == (120, 160)


def test_places_turn_with_the_map(file: Path) -> None:
    rotate_map(file, 90.0)
    grid, entry = load_map(file), load_entries(places_path(file))["kitchen"]
    assert grid.cells.shape == (160, 120)
    assert (entry.x, entry.y, entry.yaw) == pytest.approx((-0.5, 1.0, math.pi / 2))


def test_a_turned_map_is_not_continued_in_the_frame_before(file: Path) -> None:
    bundle = file.with_suffix(".bundle")
    bundle.write_bytes(b"a drive")
    crop_map(file, -1.0, None, None, None)
    assert bundle.exists()  # it has the same frame
    rotate_map(file, 90.0)
    assert not bundle.exists()
    undo_change(file)
    assert bundle.read_bytes() == b"a drive"


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        ((2.0, None, None, None), "outside the map"),
        ((3.0, 1.0, None, None), "below"),
        ((0.9, 1.1, 0.4, 0.6), "rows"),
    ],
)
def test_a_crop_that_makes_no_sense_changes_nothing(
    file: Path, corners: tuple[float | None, ...], reason: str
) -> None:
    before = file.read_bytes(), file.with_suffix(".pgm").read_bytes()
    with pytest.raises(UserError, match=reason):
        crop_map(file, *corners)
    assert (file.read_bytes(), file.with_suffix(".pgm").read_bytes()) == before


def test_the_commands_take_negative_coordinates(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for line in (
        ["map", "crop", str(file), "--x-min", "-1.5"],
        ["map", "rotate", str(file), "--degrees", "-90"],
    ):
        monkeypatch.setattr(sys, "argv", ["chefbot", *line])
        with pytest.raises(SystemExit) as end:
            main()
        assert not end.value.code
    assert load_map(file).cells.shape == (150, 120)
