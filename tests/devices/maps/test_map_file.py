"""Tests of the map server: what it publishes, and changes that are written and published at once."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tests.support.nodes import NodeRunner
from tests.support.waiting import wait_for

from chefbot.devices.maps.map_editor import MapEditor
from chefbot.devices.maps.map_file import MAX_WAITING, TOO_MANY, TURNED
from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import MapEdit, MapEditResult, MapStroke, MapZone, Place
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.storage.map_files import load_map, save_map
from chefbot.storage.places import load_entries, places_path
from chefbot.storage.zones import load_zones, zones_path

BAR = Place("bar", PoseStamped(Header(), Pose.of(SE2(2.0, 2.0, 0.0))), label="Café")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    cells = np.zeros((100, 100), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    save_map(tmp_path / "room.yaml", Grid(cells, 0.05, 0.0, 0.0))
    return tmp_path / "room.yaml"


def served(path: Path) -> NodeRunner:
    runner = NodeRunner(
        {"map_server": "chefbot.devices.maps.map_file:MapFileDevice"}, {}, {"map_server": {"map": str(path)}}
    )
    runner.run(0.2)
    return runner


def result_of(runner: NodeRunner, edit: Message) -> MapEditResult:
    """Publish a change and return its result, which comes from a thread."""
    count = len(runner.messages("map_edit_result"))
    runner.loop.publish("map_edit", edit, "page")

    def answered() -> bool:
        runner.run(0.1)
        return len(runner.messages("map_edit_result")) > count

    wait_for(answered)
    result = runner.messages("map_edit_result")[-1]
    assert isinstance(result, MapEditResult)
    return result


def test_a_change_is_written_published_and_taken_back(path: Path) -> None:
    runner = served(path)
    assert runner.messages("map_edit_result")[-1].undoable == 0
    result = result_of(runner, MapEdit("a", places=(BAR,)))
    assert (result.id, result.applied, result.description, result.undoable) == ("a", True, "", 1)
    (place,) = runner.messages("places")[-1].places
    assert (place.name, place.label) == ("bar", "Café")
    assert load_entries(places_path(path))["bar"].label == "Café"
    assert served(path).messages("map_edit_result")[-1].undoable == 1, "changes outlast the launch"
    assert result_of(runner, MapEdit("b", undo=True)).undoable == 0
    assert runner.messages("places")[-1].places == () and not places_path(path).exists()


def test_a_place_outside_the_map_is_refused_at_the_start(path: Path) -> None:
    """Else an order there is accepted, and a person loads the food for it."""
    places_path(path).write_text("places: {home: {x: 1 m, y: 1 m}, table_1: {x: 60 m, y: 1 m}}\n")
    with pytest.raises(UserError) as error:
        served(path)
    assert str(error.value) == (
        f"places file {places_path(path)}: table_1 at (60.00, 1.00) m lies outside the map, which extends from "
        "(0.00, 0.00) m over 5.0 x 5.0 m; correct the place or remove it"
    )


def test_a_refused_change_is_answered_and_changes_nothing(path: Path) -> None:
    runner = served(path)
    wrong = Place("bar", PoseStamped(Header(), Pose.of(SE2(9.0, 2.0, 0.0))))
    count = len(runner.messages("places"))
    result = result_of(runner, MapEdit("a", places=(wrong,)))
    assert (result.applied, result.description) == (False, "bar lies outside the map")
    preview = result_of(runner, MapEdit("b", places=(BAR,), preview=True))
    assert (preview.applied, preview.description) == (False, "")
    assert len(runner.messages("places")) == count and not places_path(path).exists()


def test_a_flood_of_changes_is_cut_off_and_answered(path: Path) -> None:
    runner = served(path)
    for number in range(100):
        runner.loop.publish("map_edit", MapEdit(str(number), places=(BAR,)), "page")

    def answered() -> bool:
        runner.run(0.1)
        return len(runner.messages("map_edit_result")) > 100

    wait_for(answered)
    results = runner.messages("map_edit_result")[1:]
    assert sorted(result.id for result in results) == sorted(map(str, range(100)))
    applied = [result for result in results if result.applied]
    assert MAX_WAITING <= len(applied) < 100
    assert {result.description for result in results if not result.applied} == {TOO_MANY}
    assert result_of(runner, MapEdit("later", places=(BAR,))).applied


def test_an_unexpected_error_is_not_lost(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runner = served(path)

    def fails(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(MapEditor, "changed", fails)
    result = result_of(runner, MapEdit("a", places=(BAR,)))
    assert not result.applied and "ZeroDivisionError" in result.description


WALL = MapStroke((Point(1.0, 1.0, 0.0), Point(4.0, 1.0, 0.0)), 0.1, 100)


def localize(runner: NodeRunner, pose: SE2) -> None:
    transforms = (TransformStamped.of(0, "map", "base_link", pose),)
    runner.loop.publish("tf", TFMessage(transforms), "localization")
    runner.run(0.1)


def published_map(runner: NodeRunner) -> Grid:
    message = runner.messages("map")[-1]
    assert isinstance(message, OccupancyGrid)
    return message.grid


def test_a_stroke_is_drawn_published_and_taken_back(path: Path) -> None:
    before = load_map(path)
    runner = served(path)
    result = result_of(runner, MapEdit("a", strokes=(WALL,)))
    assert (result.applied, result.description, result.undoable) == (True, "", 1)
    assert published_map(runner).at(2.0, 1.0) == load_map(path).at(2.0, 1.0) == 100
    assert result_of(runner, MapEdit("b", undo=True)).applied
    assert np.array_equal(load_map(path).cells, before.cells) and published_map(runner).at(2.0, 1.0) == 0
    assert runner.messages("initialpose") == []


def test_a_place_in_a_wall_forbids_no_stroke_elsewhere(path: Path) -> None:
    places_path(path).write_text("places: {edge: {x: 0.02 m, y: 2 m}}\n")
    result = result_of(served(path), MapEdit("a", strokes=(WALL,)))
    assert result.applied and load_map(path).at(2.0, 1.0) == 100


def test_a_preview_names_what_a_wall_cuts_off(path: Path) -> None:
    runner = served(path)
    localize(runner, SE2(2.0, 3.0, 0.0))
    assert result_of(runner, MapEdit("a", places=(BAR,))).applied
    wall = MapStroke((Point(0.0, 2.5, 0.0), Point(5.0, 2.5, 0.0)), 0.1, 100)
    result = result_of(runner, MapEdit("b", strokes=(wall,), preview=True))
    assert (result.applied, result.description) == (False, "No path from the robot to: Café.")
    trapped = MapStroke((Point(2.0, 3.0, 0.0),), 0.3, 100)
    assert (
        "would then be inside a wall"
        in result_of(runner, MapEdit("c", strokes=(trapped,), preview=True)).description
    )
    assert load_map(path).at(2.0, 2.5) == 0


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        (MapEdit("b", strokes=(MapStroke((Point(2.0, 2.0, 0.0),), 0.3, 100),)), "Café lies in a wall"),
        (MapEdit("b", crop=(Point(2.5, 0.0, 0.0), Point(5.0, 5.0, 0.0))), "Café lies outside the map"),
        (
            MapEdit(
                "b", crop=(Point(2.5, 2.5, 0.0), Point(5.0, 5.0, 0.0)), places=(Place("pass", BAR.pose),)
            ),
            "Café lies outside the map; pass lies outside the map",
        ),
        (MapEdit("b", crop=(Point(1.9, 1.9, 0.0), Point(2.0, 2.0, 0.0))), "fewer than 10 rows"),
        (MapEdit("b", crop=(Point(1.0, 1.0, 0.0), Point(3.0, 3.0, 0.0))), "no wall left"),
        (MapEdit("b", crop=(Point(1.0, 1.0, 0.0),)), "two corners"),
        (MapEdit("b", strokes=(MapStroke((Point(1.0, 1.0, 0.0),), 0.3, 50),)), "100, 0 or -1, not 50"),
    ],
)
def test_a_map_that_would_not_fit_is_refused(path: Path, edit: MapEdit, reason: str) -> None:
    runner = served(path)
    assert result_of(runner, MapEdit("a", places=(BAR,))).applied
    image = path.with_suffix(".pgm").read_bytes()
    result = result_of(runner, edit)
    assert not result.applied and reason in result.description and result.undoable == 1
    assert path.with_suffix(".pgm").read_bytes() == image


def test_a_turned_map_turns_places_zones_and_the_robot(path: Path) -> None:
    runner = served(path)
    localize(runner, SE2(1.0, 3.0, 0.5))
    corners = tuple(Point(x, y, 0.0) for x, y in ((1.0, 1.0), (2.0, 1.0), (2.0, 1.5)))
    lane = MapZone("lane", "one_way", corners, 0.0, 0.25)
    assert result_of(runner, MapEdit("a", places=(BAR,), zones=(lane,))).applied
    result = result_of(runner, MapEdit("b", rotation=math.pi / 2))
    assert result.applied and result.description == TURNED
    (pose,) = runner.messages("initialpose")
    assert pose.pose.pose.se2 == pytest.approx((-3.0, 1.0, 0.5 + math.pi / 2))  # type: ignore[attr-defined]
    bar = load_entries(places_path(path))["bar"]
    assert (bar.x, bar.y, bar.yaw) == pytest.approx((-2.0, 2.0, math.pi / 2), abs=1e-3)
    (zone,) = load_zones(zones_path(path)).zones
    assert zone.direction == pytest.approx(0.25 + math.pi / 2, abs=1e-3)
    assert zone.corners[1].x == pytest.approx(-1.0, abs=1e-3)
    assert published_map(runner).origin_x == pytest.approx(-5.0)
    localize(runner, SE2(-3.0, 1.0, 0.5 + math.pi / 2))
    assert result_of(runner, MapEdit("c", undo=True)).applied
    back = runner.messages("initialpose")[-1]
    assert back.pose.pose.se2 == pytest.approx((1.0, 3.0, 0.5))  # type: ignore[attr-defined]
    assert load_map(path).origin_x == 0.0


def test_a_picture_changed_by_hand_is_the_one_that_is_drawn_on(path: Path) -> None:
    runner = served(path)
    grid = load_map(path)
    grid.cells[20:24, 20:24] = 100
    save_map(path, grid)
    assert result_of(runner, MapEdit("a", strokes=(WALL,))).applied
    assert load_map(path).at(1.1, 1.1) == 100 and load_map(path).at(3.0, 1.0) == 100


def test_a_preview_names_where_the_robot_no_longer_fits(path: Path) -> None:
    runner = served(path)
    localize(runner, SE2(4.0, 4.0, 0.0))
    assert result_of(runner, MapEdit("a", places=(BAR,))).applied
    beside = MapStroke((Point(2.1, 1.5, 0.0), Point(2.1, 2.5, 0.0)), 0.05, 100)
    result = result_of(runner, MapEdit("b", strokes=(beside,), preview=True))
    assert result.description == "Too near to a wall for the robot: Café."
    through = MapStroke((Point(4.1, 3.5, 0.0), Point(4.1, 4.5, 0.0)), 0.05, 100)
    assert "too near to one" in result_of(runner, MapEdit("c", strokes=(through,), preview=True)).description


def test_the_picture_of_another_map_is_not_replaced(path: Path) -> None:
    other = path.with_name("other.pgm")
    other.write_bytes(path.with_suffix(".pgm").read_bytes())
    path.with_suffix(".yaml").write_text(path.read_text().replace("room.pgm", "other.pgm"))
    before = path.with_suffix(".pgm").read_bytes()
    runner = served(path)
    result = result_of(runner, MapEdit("a", strokes=(WALL,)))
    assert (
        not result.applied and "is the picture of another map" in result.description and result.undoable == 0
    )
    assert path.with_suffix(".pgm").read_bytes() == before and "other.pgm" in path.read_text()
    path.with_suffix(".pgm").unlink()
    assert result_of(runner, MapEdit("b", strokes=(WALL,))).applied
    assert load_map(path).at(2.0, 1.0) == 100 and other.read_bytes() == before


def test_two_editors_do_not_overwrite_each_other(path: Path) -> None:
    """Mia and Max have the form of the bar open; who saves later sees that first, and may save again."""
    runner = served(path)
    assert result_of(runner, MapEdit("a", places=(BAR,), edited_by="Mia")).applied
    moved, renamed = (
        Place("bar", PoseStamped(Header(), Pose.of(SE2(x, 3.0, 0.0))), label=label)
        for x, label in ((3.0, "Café"), (2.0, "Bar"))
    )
    last = result_of(runner, MapEdit("b", places=(moved,), seen_change="a", edited_by="Max"))
    assert (last.applied, last.last_id, last.last_change) == (True, "b", "Café was moved")
    assert last.last_edited_by == "Max"
    refused = result_of(runner, MapEdit("c", places=(renamed,), seen_change="a"))
    changed = "The map has changed in the meantime (last change: Café was moved, by Max); look at it and press again"
    assert (refused.applied, refused.description) == (False, changed)
    assert load_entries(places_path(path))["bar"].x == 3.0
    undo = result_of(runner, MapEdit("d", undo=True, seen_change="a"))
    assert (undo.applied, undo.description) == (False, changed), "the button named another change"
    assert result_of(runner, MapEdit("e", places=(renamed,), seen_change=refused.last_id)).applied
    assert result_of(runner, MapEdit("f", undo=True, seen_change="e")).last_change == "Café was moved"


def test_the_first_change_of_a_map_is_not_overwritten_either(path: Path) -> None:
    runner = served(path)
    untouched = runner.messages("map_edit_result")[-1].last_id
    assert result_of(runner, MapEdit("a", places=(BAR,), seen_change=untouched)).applied
    refused = result_of(runner, MapEdit("b", deleted_places=("bar",), seen_change=untouched))
    changed = "The map has changed in the meantime (last change: Café was added); look at it and press again"
    assert (refused.applied, refused.description) == (False, changed)
    assert result_of(runner, MapEdit("c", undo=True, seen_change="a")).last_id == untouched


def test_a_preview_does_not_depend_on_what_others_changed(path: Path) -> None:
    runner = served(path)
    assert result_of(runner, MapEdit("a", places=(BAR,))).applied
    preview = result_of(runner, MapEdit("b", strokes=(WALL,), preview=True, seen_change="older"))
    assert (preview.applied, preview.description) == (False, "")


def test_a_map_with_a_damaged_version_is_served(path: Path) -> None:
    assert result_of(served(path), MapEdit("a", places=(BAR,))).applied
    (path.with_suffix(".versions") / "000001" / "change.json").write_text("half")
    runner = served(path)
    assert "change.json is damaged" in runner.messages("map_edit_result")[-1].last_change
    assert "change.json is damaged" in result_of(runner, MapEdit("b", undo=True)).description
    assert runner.messages("places")[-1].places
