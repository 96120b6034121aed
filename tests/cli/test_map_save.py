"""`chefbot map save`: the map that a robot shows, or the adjusted one that it is making, and the places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.support.fake_robot import PLACES, fake_robot

from chefbot.cli.map.save import save_running_map
from chefbot.errors import ChefbotError, UserError
from chefbot.mapping.map_format import encode_map_yaml, encode_pgm
from chefbot.maths.grid import Grid
from chefbot.slam.params import GmappingParams
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.map_files import load_map
from chefbot.storage.mapped_drives import encode_drives
from chefbot.storage.places import load_places


def test_map_save_saves_what_the_robot_shows(tmp_path: Path) -> None:
    with fake_robot() as robot:
        robot.show_places()
        grid = robot.show_map()
        save_running_map(tmp_path / "room", robot.url)
    saved = load_map(tmp_path / "room.yaml")
    assert np.array_equal(saved.cells, grid.cells)
    assert (saved.resolution, saved.origin_x, saved.origin_y) == (0.05, -1.0, -0.5)
    assert load_places(tmp_path / "room.places.yaml")["kitchen"] == pytest.approx(PLACES["kitchen"], abs=1e-3)


def kept_map(rows: int) -> tuple[Grid, bytes]:
    """Return a map with so many free rows, and a bundle of it as the map recorder writes it."""
    grid = Grid(
        np.repeat([[0], [100]], [rows, 40 - rows], axis=0).astype(np.int8).repeat(30, axis=1), 0.05, 0.0, 0.0
    )
    image = encode_pgm(grid)
    return grid, encode_drives(
        GmappingParams(), [], {"map.yaml": encode_map_yaml("map.pgm", grid), "map.pgm": image}
    )


def test_map_save_takes_the_adjusted_map_with_its_drive(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """While a map is being made; one whose drive is not kept is saved as it is shown, beside the bundle of before."""
    grid, bundle = kept_map(20)
    with fake_robot() as robot:
        shown = robot.show_map()
        robot.show_mapping(bundle)
        save_running_map(tmp_path / "room", robot.url)
        assert np.array_equal(load_map(tmp_path / "room.yaml").cells, grid.cells)
        assert (tmp_path / "room.bundle").read_bytes() == bundle
        robot.show_mapping(b"")
        save_running_map(tmp_path / "room", robot.url)
        assert np.array_equal(load_map(tmp_path / "room.yaml").cells, shown.cells)
    assert (tmp_path / "room.bundle").read_bytes() == bundle, "nothing is lost"
    printed = capsys.readouterr().out
    assert "keeps no drive" in printed and "kept" in printed


def test_map_save_refuses_a_damaged_map(tmp_path: Path) -> None:
    with fake_robot() as robot:
        robot.show_map()
        robot.show_mapping(kept_map(20)[1][:100])
        with pytest.raises(ChefbotError, match="damaged"):
            save_running_map(tmp_path / "room", robot.url)
    assert list(tmp_path.iterdir()) == []


def test_map_save_keeps_places_that_somebody_wrote(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "room.places.yaml"
    mine.write_text("places: {bar: {x: 1 m, y: 1 m}}\n")
    with fake_robot() as robot:
        robot.show_places()
        robot.show_map()
        save_running_map(tmp_path / "room", robot.url)
    assert list(load_places(mine)) == ["bar"]
    assert "kept" in capsys.readouterr().out


@pytest.mark.slow
def test_map_save_without_a_map_or_a_folder(tmp_path: Path) -> None:
    with fake_robot() as robot:
        with pytest.raises(UserError, match="no map yet"):
            save_running_map(tmp_path / "room", robot.url)
        robot.show_map()
        with pytest.raises(StorageError, match="cannot be written"):
            save_running_map(tmp_path / "none" / "room", robot.url)
    assert list(tmp_path.iterdir()) == []
