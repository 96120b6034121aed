"""Tests of changes of a map's places and zones: checked, written, taken back, and nothing lost on an error."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.devices.maps.edit_preview import side_effects
from chefbot.devices.maps.map_editor import MapChange, MapEditor
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.grid import FREE, OCCUPIED, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import MapEdit, MapZone, Place
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.places import PlaceEntry, find_place
from chefbot.zones.contradictions import ZoneError

ROBOT = load_robot("chefbot_lidar")
PLACES = """\
# Written by hand.
places:
  kitchen: {x: 1 m, y: 1 m}   # near the door
  table_1: {x: 1 m, y: 5 m, yaw: 90 deg, xy_tolerance: 2 cm}
"""


def room() -> Grid:
    """A room of 6 m x 6 m with walls around it; its left half is one corridor wide at y = 3 m."""
    cells = np.full((120, 120), FREE, np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = OCCUPIED
    cells[58:62, 40:] = OCCUPIED
    return Grid(cells, 0.05, 0.0, 0.0)


@pytest.fixture
def editor(tmp_path: Path) -> MapEditor:
    (tmp_path / "room.places.yaml").write_text(PLACES)
    return MapEditor(tmp_path / "room.yaml", tmp_path / "room.zones.yaml", room(), {})


def place(name: str, x: float = 2.0, y: float = 2.0, label: str = "") -> Place:
    return Place(name, PoseStamped(Header(), Pose.of(SE2(x, y, 0.5))), label=label)


def zone(
    name: str = "keep_out_1", kind: str = "keep_out", corners: tuple[tuple[float, float], ...] = ()
) -> MapZone:
    corners = corners or ((0.0, 2.5), (2.0, 2.5), (2.0, 3.5), (0.0, 3.5))
    return MapZone(name, kind, tuple(Point(x, y, 0.0) for x, y in corners))


def test_a_new_place_with_a_label_keeps_the_rest_of_the_file(editor: MapEditor, tmp_path: Path) -> None:
    editor.apply(MapEdit(places=(place("table_2", label=" 窗边 二 "),)))
    text = (tmp_path / "room.places.yaml").read_text()
    assert text.startswith(PLACES) and text.count("\n") == PLACES.count("\n") + 1
    content = editor.content()
    assert content.places["table_2"] == PlaceEntry(
        x=2.0, y=2.0, yaw=pytest.approx(0.5, abs=1e-3), label="窗边 二"
    )
    labels = {name: entry.label for name, entry in content.places.items()}
    assert (
        find_place("窗边 二", content.places, labels) == find_place("2", content.places, labels) == "table_2"
    )


def test_a_moved_place_keeps_its_tolerance(editor: MapEditor) -> None:
    editor.apply(MapEdit(places=(place("table_1", 1.5, 5.0),)))
    moved = editor.content().places["table_1"]
    assert (moved.x, moved.xy_tolerance) == (1.5, 0.02)


def test_a_change_by_hand_in_the_meantime_is_kept(editor: MapEditor, tmp_path: Path) -> None:
    editor.apply(MapEdit(zones=(zone(),)))
    (tmp_path / "room.places.yaml").write_text(PLACES + "  table_7: {x: 2 m, y: 5 m}\n")
    editor.apply(MapEdit(places=(place("table_8"),), deleted_places=("kitchen",)))
    assert list(editor.content().places) == ["table_1", "table_7", "table_8"]
    assert [one.name for one in editor.content().zones] == ["keep_out_1"]


@pytest.mark.parametrize("kind", ["keep_out", "slow", "preferred", "one_way"])
def test_zones_of_every_kind_survive_the_file(editor: MapEditor, kind: str) -> None:
    written = MapZone(
        "a", kind, zone().corners, 0.25 if kind == "slow" else 0.0, 0.5 if kind == "one_way" else 0.0
    )
    editor.apply(MapEdit(zones=(written,)))
    (read,) = editor.content().zones
    assert (read.name, read.kind, read.speed) == ("a", kind, written.speed)
    assert read.direction == pytest.approx(written.direction, abs=1e-3) and np.allclose(
        read.array, written.array
    )


def test_a_preview_names_what_is_cut_off_and_writes_nothing(editor: MapEditor, tmp_path: Path) -> None:
    start = SE2(1.0, 1.0, 0.0)
    assert (
        side_effects(ROBOT, editor.changed(MapEdit(zones=(zone(),))), start)
        == "No path from the robot to: table 1."
    )
    beside = zone(corners=((3.0, 4.0), (4.0, 4.0), (4.0, 5.0)))
    assert side_effects(ROBOT, editor.changed(MapEdit(zones=(beside,))), start) == ""
    inside = zone(corners=((0.5, 4.5), (1.5, 4.5), (1.5, 5.5), (0.5, 5.5)))
    effects = side_effects(ROBOT, editor.changed(MapEdit(zones=(inside,))), start)
    assert effects == "The place table_1 lies in the keep-out zone 1 and cannot be reached."
    assert [path.name for path in tmp_path.iterdir()] == ["room.places.yaml"]


def test_a_new_place_out_of_reach_is_reported(editor: MapEditor) -> None:
    start = SE2(1.0, 1.0, 0.0)
    beside_wall = MapEdit(places=(place("terrace", 0.1, 4.5),))
    assert (
        side_effects(ROBOT, editor.changed(beside_wall), start)
        == "Too near to a wall for the robot: terrace."
    )
    assert side_effects(ROBOT, editor.changed(MapEdit(places=(place("bar", 1.0, 4.5),))), start) == ""
    walled_in = editor.changed(MapEdit(zones=(zone(),))).after
    change = MapChange(
        walled_in, walled_in._replace(places={**walled_in.places, "bar": PlaceEntry(x=1.0, y=4.5)})
    )
    assert side_effects(ROBOT, change, start) == "No path from the robot to: bar."


def test_a_preview_reports_a_trapped_robot(editor: MapEditor) -> None:
    edit = MapEdit(zones=(zone(corners=((0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (0.5, 1.5))),))
    effect = side_effects(ROBOT, editor.changed(edit), SE2(1.0, 1.0, 0.0))
    assert effect.endswith("The robot is in the keep-out zone 1 and cannot leave it by itself.")


def test_two_people_who_add_at_once_get_two_names(editor: MapEditor) -> None:
    for x in (2.0, 3.0):
        editor.apply(MapEdit(places=(place("table_2", x, label=f"x {x}"),), new=True))
        editor.apply(MapEdit(zones=(zone("keep_out_1"),), new=True))
    content = editor.content()
    assert (content.places["table_2"].x, content.places["table_3"].x) == (2.0, 3.0)
    assert [one.name for one in content.zones] == ["keep_out_1", "keep_out_2"]
    editor.apply(MapEdit(places=(place("kitchen", 3.5, label="second"),), new=True))
    assert editor.content().places["kitchen_2"].x == 3.5


def test_a_new_label_leaves_a_pose_that_was_changed_by_hand(editor: MapEditor, tmp_path: Path) -> None:
    path = tmp_path / "room.places.yaml"
    path.write_text(path.read_text().replace("y: 5 m", "y: 4.5 m"))
    editor.apply(MapEdit(places=(place("table_1", 1.0, 5.0, "Café"),), keep_poses=True))
    changed = editor.content().places["table_1"]
    assert (changed.y, changed.label, changed.xy_tolerance) == (4.5, "Café", 0.02)


def test_a_change_by_hand_is_not_taken_back(editor: MapEditor, tmp_path: Path) -> None:
    editor.apply(MapEdit(places=(place("table_2"),)))
    path = tmp_path / "room.places.yaml"
    text = path.read_text() + "# mine\n"
    path.write_text(text)
    with pytest.raises(StorageError, match="edited by hand"):
        editor.undo()
    assert path.read_text() == text
    editor.apply(MapEdit(places=(place("table_3"),)))
    editor.undo()
    assert path.read_text() == text


def test_a_save_without_a_change_makes_no_version(editor: MapEditor) -> None:
    editor.apply(MapEdit(places=(place("kitchen", 1.0, 1.0),), keep_poses=True))
    assert len(editor.versions) == 0


@pytest.mark.parametrize("label", ["Kitchen", "table 1", "TABLE_1", "ｋｉｔｃｈｅｎ"])
def test_no_two_places_look_the_same(editor: MapEditor, label: str) -> None:
    with pytest.raises(UserError, match="Another place is called"):
        editor.apply(MapEdit(places=(place("table_2", label=label),)))
    editor.apply(MapEdit(places=(place("table_2", label="Zoë"),)))
    with pytest.raises(UserError, match="Another place is called"):
        editor.apply(MapEdit(places=(place("table_3", label="Zoe\u0308"),)))


def test_changes_are_taken_back_one_by_one(editor: MapEditor, tmp_path: Path) -> None:
    editor.apply(MapEdit(places=(place("table_2"),)))
    editor.apply(MapEdit(zones=(zone(),)))
    assert len(editor.versions) == 2
    editor.undo()
    assert not (tmp_path / "room.zones.yaml").exists() and "table_2" in editor.content().places
    editor.undo()
    assert (tmp_path / "room.places.yaml").read_text() == PLACES
    with pytest.raises(UserError, match="no map change to undo"):
        editor.undo()


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (MapEdit(places=(place("table_2", -1.0),)), "table 2 lies outside the map"),
        (MapEdit(places=(place("table_2", 4.0, 3.0, "bar"),)), "bar lies in a wall"),
        (MapEdit(places=(place("Table 2"),)), "'Table 2' must consist of small letters"),
        (MapEdit(places=(place("../x"),)), "must consist of small letters"),
        (MapEdit(places=(place("table_2", label="a\nb"),)), "at most 40 printable characters"),
        (MapEdit(deleted_places=("tabel_1",)), "no place 'tabel_1' to delete.*did you mean 'table_1'"),
        (MapEdit(deleted_zones=("a",)), "no zone 'a' to delete"),
        (MapEdit(zones=(zone(corners=((1, 1), (2, 2), (2, 1), (1, 2))),)), "edges cross or touch"),
        (MapEdit(zones=(zone(corners=((9, 9), (10, 9), (10, 10))),)), "lies outside the map"),
    ],
)
def test_an_invalid_change_has_one_sentence_and_no_effect(
    editor: MapEditor, edit: MapEdit, sentence: str
) -> None:
    before = editor.content()
    for attempt in (lambda: editor.changed(edit), lambda: editor.apply(edit)):
        with pytest.raises((UserError, ZoneError), match=sentence):
            attempt()
    assert editor.content() == before and len(editor.versions) == 0


def test_a_failed_write_changes_nothing(
    editor: MapEditor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full when the second of two files is written."""
    replace = os.replace

    def full(source: str | Path, target: str | Path) -> None:
        if Path(target).name == "room.zones.yaml":
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(StorageError, match="No space left"):
        editor.apply(MapEdit(places=(place("table_2"),), zones=(zone(),)))
    assert (tmp_path / "room.places.yaml").read_text() == PLACES
    assert not (tmp_path / "room.zones.yaml").exists() and len(editor.versions) == 0


def test_drawn_places_are_written_with_the_first_change(tmp_path: Path) -> None:
    drawn = {"kitchen": PlaceEntry(x=1.0, y=1.0)}
    editor = MapEditor(tmp_path / "room.yaml", tmp_path / "room.zones.yaml", room(), drawn)
    editor.apply(MapEdit(places=(place("table_1"),)))
    assert list(editor.content().places) == ["kitchen", "table_1"]


EDITS = st.one_of(
    st.builds(
        lambda name, x, y: MapEdit(places=(place(name, x, y),)),
        st.sampled_from(["table_1", "table_2", "a", ""]),
        st.floats(-1.0, 7.0),
        st.floats(-1.0, 7.0),
    ),
    st.builds(lambda name: MapEdit(deleted_places=(name,)), st.sampled_from(["table_1", "kitchen", "a"])),
    st.builds(
        lambda name, corners: MapEdit(zones=(zone(name, corners=tuple(corners)),)),
        st.sampled_from(["a", "b"]),
        st.lists(st.tuples(st.floats(0, 6), st.floats(0, 6)), min_size=3, max_size=5),
    ),
    st.just(MapEdit(undo=True)),
)


@settings(max_examples=15)
@given(st.lists(EDITS, max_size=8))
def test_each_undo_is_the_content_before_the_change(
    tmp_path_factory: pytest.TempPathFactory, edits: list[MapEdit]
) -> None:
    folder = tmp_path_factory.mktemp("map")
    editor = MapEditor(folder / "room.yaml", folder / "room.zones.yaml", room(), {})
    versions = [editor.content()]
    for edit in edits:
        try:
            if edit.undo:
                editor.undo()
                versions.pop()
            else:
                editor.apply(edit)
                versions.append(editor.content())
        except ChefbotError:
            pass
        assert len(editor.versions) == len(versions) - 1
        now = editor.content()
        assert now.places == versions[-1].places
        assert [one.name for one in now.zones] == [one.name for one in versions[-1].zones]
