"""The web UI's device turns commands of an operator into changes of the map, with names for what is new."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import MapEdit, MapEditResult, Place, Places
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import NoParams
from chefbot.ui import commands as do
from chefbot.ui.access.audit_log import audit_path, read_entries
from chefbot.ui.editing.map_edit_device import MapEditDevice

CORNERS = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]


class Shown:
    """Keeps the layers that a device sets."""

    def __init__(self) -> None:
        self.layers: dict[str, Any] = {}

    def set_layer(self, layer: str, payload: Any) -> None:
        self.layers[layer] = payload


class Pen(MapEditDevice):
    """The base class alone, with a server that only keeps its layers."""

    params: NoParams

    def start(self) -> None:
        super().start()
        self._server = Shown()  # type: ignore[assignment]


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    runner = NodeRunner({"page": f"{__name__}:Pen"}, {})
    places = tuple(
        Place(name, PoseStamped(Header(), Pose.of(SE2(1.0, 0.0, 0.0))), label=label)
        for name, label in (("kitchen", ""), ("table_1", "窗边"), ("table_3", ""))
    )
    runner.loop.publish("places", Places(places), "map")
    corners = tuple(Point(x, y, 0.0) for x, y in CORNERS)
    runner.loop.publish("zones", MapZones(Header(), (MapZone("keep_out_1", KEEP_OUT, corners),)), "map")
    runner.run(0.1)
    yield runner
    runner.system.stop()


def edits(nodes: NodeRunner, *commands: Any) -> list[MapEdit]:
    device: Any = nodes.system.nodes["page"]
    for command in commands:
        device._execute_map_edit(command, "Mia")
    nodes.run(0.1)
    return nodes.messages("map_edit")


def test_places_labels_zones_and_results_are_shown(nodes: NodeRunner) -> None:
    device: Any = nodes.system.nodes["page"]
    layers = device._server.layers
    assert layers["labels"] == {"table_1": "窗边"} and list(layers["places"]) == [
        "kitchen",
        "table_1",
        "table_3",
    ]
    assert [view.name for view in layers["zones"]] == ["keep_out_1"]
    result = MapEditResult("a", applied=True)
    nodes.loop.publish("map_edit_result", result, "map")
    nodes.run(0.1)
    assert layers["edits"] == (result,)


def test_new_places_get_the_first_free_name_of_their_kind(nodes: NodeRunner) -> None:
    table, room, kitchen, known = edits(
        nodes,
        do.PutPlace(1.0, 2.0, 0.5, kind="table", label=" Café "),
        do.PutPlace(1.0, 2.0, 0.5, kind="room"),
        do.PutPlace(1.0, 2.0, 0.5, kind="kitchen"),
        do.PutPlace(1.0, 2.0, 0.5, name="table_3", id="a"),
    )
    assert [edit.places[0].name for edit in (table, room, kitchen, known)] == [
        "table_2",
        "room_1",
        "kitchen_1",
        "table_3",
    ]
    assert [edit.new for edit in (table, room, kitchen, known)] == [True, True, True, False]
    assert table.places[0].label == "Café" and table.places[0].pose.pose.se2 == SE2(1.0, 2.0, 0.5)
    assert table.places[0].pose.header.frame_id == "map" and known.id == "a"


def test_zones_have_the_numbers_of_their_kind_only(nodes: NodeRunner) -> None:
    keep_out, slow, lane = edits(
        nodes,
        do.PutZone(CORNERS, "keep_out", speed=0.5, direction=1.0, preview=True),
        do.PutZone(CORNERS, "slow", speed=0.5, direction=1.0),
        do.PutZone(CORNERS, "one_way", speed=0.5, direction=1.0, name="exit"),
    )
    found = [
        (edit.zones[0].name, edit.zones[0].speed, edit.zones[0].direction) for edit in (keep_out, slow, lane)
    ]
    assert found == [("keep_out_2", 0.0, 0.0), ("slow_1", 0.5, 0.0), ("exit", 0.0, 1.0)]
    assert (keep_out.preview, slow.preview) == (True, False)


def test_a_zone_of_another_kind_gets_a_number_of_it(nodes: NodeRunner) -> None:
    slow, same, named = edits(
        nodes,
        do.PutZone(CORNERS, "slow", speed=0.5, name="keep_out_1"),
        do.PutZone(CORNERS, "keep_out", name="keep_out_1"),
        do.PutZone(CORNERS, "slow", speed=0.5, name="stairs"),
    )
    found = [(edit.zones[0].name, edit.deleted_zones, edit.new) for edit in (slow, same, named)]
    assert found == [("slow_1", ("keep_out_1",), True), ("keep_out_1", (), False), ("stairs", (), False)]


def test_deletions_and_undo_are_passed_on(nodes: NodeRunner) -> None:
    place, zone, undo = edits(
        nodes, do.DeletePlace("table_1"), do.DeleteZone("keep_out_1"), do.UndoMapEdit(id="a")
    )
    assert (place.deleted_places, zone.deleted_zones) == (("table_1",), ("keep_out_1",))
    assert undo.undo and undo.id == "a"


def test_changes_of_the_map_are_passed_on(nodes: NodeRunner) -> None:
    device: Any = nodes.system.nodes["page"]
    for command in (
        do.DrawOnMap([[(0.0, 0.0), (1.0, 0.5)], [(2.0, 2.0)]], 0.2, "unknown", id="a"),
        do.CropMap(0.0, 1.0, 4.0, 5.0, preview=True, id="b"),
        do.RotateMap(0.5, id="c"),
    ):
        device._execute_map_change(command, "Mia")
    nodes.run(0.1)
    drawn, crop, rotation = nodes.messages("map_edit")
    assert [(len(one.points), one.width, one.value) for one in drawn.strokes] == [(2, 0.2, -1), (1, 0.2, -1)]
    assert [(corner.x, corner.y) for corner in crop.crop] == [(0.0, 1.0), (4.0, 5.0)]
    assert (drawn.preview, crop.preview, rotation.rotation, rotation.id) == (False, True, 0.5, "c")


def test_a_change_carries_who_made_it_and_what_they_saw(nodes: NodeRunner) -> None:
    (edit,) = edits(nodes, do.DeletePlace("table_1", id="a", seen_change="b"))
    assert (edit.id, edit.seen_change, edit.edited_by) == ("a", "b", "Mia")


def test_a_refused_change_is_in_the_audit_log(nodes: NodeRunner) -> None:
    """The map server refuses later than the web UI, which has recorded the press already."""
    edits(nodes, do.DeletePlace("table_1", id="a"), do.DeletePlace("kitchen", id="b"))
    for result in (MapEditResult("a", applied=True), MapEditResult("b", description="It is needed.")):
        nodes.loop.publish("map_edit_result", result, "map")
    nodes.run(0.1)
    device: Any = nodes.system.nodes["page"]
    device.audit.close()
    (refused,) = [entry for entry in read_entries(audit_path(device.robot.name)) if entry.refused]
    assert (refused.name, refused.action, refused.refused) == ("Mia", "delete_place", "It is needed.")
