"""The web UI's device passes orders on to explorer and mapper, and saves maps under a name."""

from __future__ import annotations

import base64
import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner
from tests.support.page_device import page_device
from tests.support.waiting import wait_for
from tests.ui.test_map_edit_device import Shown

from chefbot.devices.state_files import maps_folder
from chefbot.errors import UserError
from chefbot.mapping.map_format import encode_map_yaml, encode_pgm
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ExplorationStatus
from chefbot.msgs.chefbot_msgs.launches import LaunchStatus, MapFolder
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Empty, Header, String
from chefbot.runtime.launch import Launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node import NoParams
from chefbot.runtime.node_container import LAUNCH_TOPIC
from chefbot.slam.params import GmappingParams
from chefbot.storage.map_files import load_map
from chefbot.storage.map_versions import versions_of
from chefbot.storage.mapped_drives import encode_drives
from chefbot.storage.new_map import NO_MAP
from chefbot.storage.places import load_entries, places_path, save_places
from chefbot.storage.zones import zones_path
from chefbot.ui import commands as do
from chefbot.ui.display.views import LaunchView, MappingView
from chefbot.ui.editing import mapping_device
from chefbot.ui.editing.mapping_device import NO_DRIVE, OTHER_FRAME, MappingDevice, launch_arguments


def hall(free: int) -> OccupancyGrid:
    """Return a map with so many free rows, the others occupied."""
    cells = np.full((20, 30), 100, np.int8)
    cells[:free] = 0
    return OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, 0.0, 0.0))


MAP = hall(10)
PLACES = {"bar": SE2(0.5, 0.25, 0.0)}


class Surveyor(MappingDevice):
    """The base class alone, with a server that only keeps its layers."""

    params: NoParams

    def start(self) -> None:
        super().start()
        self._server = Shown()  # type: ignore[assignment]


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    monkeypatch.setattr(mapping_device, "WRITE_TIMEOUT", 0.2)  # there is no map recorder
    with page_device(f"{__name__}:Surveyor", tmp_path, monkeypatch) as runner:
        yield runner


NUMBERS = itertools.count()
"""Ids of the requests to save a map."""


def device(nodes: NodeRunner) -> Any:
    return nodes.system.nodes["page"]


def outcome(
    nodes: NodeRunner,
    name: str,
    newest: OccupancyGrid | None = MAP,
    places: Mapping[str, SE2] = PLACES,
    *,
    replace: bool = False,
) -> str:
    """Save a map and return what the web UI then shows."""
    return outcomes(nodes, do.SaveMap(name, replace, f"{next(NUMBERS)}"), newest=newest, places=places)[-1]


def outcomes(
    nodes: NodeRunner,
    *requests: do.SaveMap,
    newest: OccupancyGrid | None = MAP,
    places: Mapping[str, SE2] = PLACES,
) -> list[str]:
    """Request maps to be saved, one after the other, and return what the web UI then shows about each."""
    for request in requests:
        device(nodes)._execute_mapping(request, newest, places)

    def ended() -> bool:
        nodes.run(0.1)
        return {request.id for request in requests} <= {one.id for one in device(nodes)._mapping.outcomes}

    wait_for(ended)
    shown = {one.id: one.sentence for one in device(nodes)._server.layers["mapping"].outcomes}
    return [shown[request.id] for request in requests]


def test_no_other_goal_ends_an_exploration(nodes: NodeRunner) -> None:
    page = device(nodes)
    page._check_exploration(do.GoPlace("kitchen"))
    nodes.loop.publish("exploration_status", ExplorationStatus(Header(), False, 1, "Exploring."), "explorer")
    nodes.run(0.1)
    for command in (do.GoPlace("kitchen"), do.Goal(0.0, 0.0, 0.0), do.Patrol(["bar"]), do.Follow()):
        with pytest.raises(UserError, match="end the exploration first"):
            page._check_exploration(command)
    page._check_exploration(do.Cancel())


def test_each_of_two_people_who_save_gets_an_outcome(nodes: NodeRunner) -> None:
    first, second = outcomes(nodes, do.SaveMap("hall", id="anna"), do.SaveMap("hall", id="ben"))
    assert first.startswith("Saved.") and second == "There is a map called hall already."


def test_a_map_is_saved_under_its_name(nodes: NodeRunner) -> None:
    path = maps_folder() / "ground_floor.yaml"
    assert outcome(nodes, "ground_floor") == f"Saved. To use it: chefbot launch waiter map_file:={path}"
    assert np.array_equal(load_map(path).cells, MAP.grid.cells)
    assert list(load_entries(places_path(path))) == ["bar"]


@pytest.mark.parametrize(
    ("args", "text"),
    [
        ({"world": "room", "robot": "chefbot_lidar", "built": False}, "world:=room robot:=chefbot_lidar "),
        ({"world": "room", "robot": "r7.yaml", "built": True}, "built:=true robot:=r7.yaml "),
        ({"world": "room", "robot": "chefbot", "port": 8080}, "world:=room robot:=chefbot "),
        ({"world": "room", "robot": "chefbot", "port": 8085}, "world:=room robot:=chefbot port:=8085 "),
        ({}, ""),
    ],
)
def test_the_command_is_for_the_same_robot_and_world(args: dict[str, Any], text: str) -> None:
    launch = String(Launch(name="gmapping_demo", description="", args=args, nodes={}).to_json())
    assert launch_arguments([Publication(LAUNCH_TOPIC, launch, "chefbot", True, 0, True)]) == text
    assert launch_arguments([]) == ""


def free_rows(name: str) -> int:
    return int((load_map(maps_folder() / f"{name}.yaml").cells == 0).all(axis=1).sum())


def test_a_map_is_replaced_only_on_request(nodes: NodeRunner) -> None:
    outcome(nodes, "hall")
    assert outcome(nodes, "hall", hall(20)) == "There is a map called hall already."
    assert free_rows("hall") == 10
    outcome(nodes, "hall", hall(20), replace=True)
    assert free_rows("hall") == 20


@pytest.mark.parametrize("unusable", [None, hall(0)])
def test_a_map_that_nobody_can_use_is_not_saved(nodes: NodeRunner, unusable: OccupancyGrid | None) -> None:
    assert outcome(nodes, "hall", unusable) == NO_MAP
    assert not (maps_folder() / "hall.yaml").exists()


def test_what_cannot_be_saved_has_a_sentence(nodes: NodeRunner) -> None:
    maps_folder().write_text("a file")
    assert outcome(nodes, "hall").startswith("The map was not saved: ")


def test_a_map_without_free_floor_replaces_none(nodes: NodeRunner) -> None:
    outcome(nodes, "hall")
    assert outcome(nodes, "hall", hall(0), replace=True) == NO_MAP
    assert free_rows("hall") == 10


def map_with_place_and_zone(nodes: NodeRunner, name: str) -> Path:
    """Save a map with a place and a zone beside it."""
    outcome(nodes, name)
    path = maps_folder() / f"{name}.yaml"
    zones_path(path).write_text("zones: {stairs: {type: keep_out, rectangle: [0 m, 0 m, 0.5 m, 0.5 m]}}\n")
    return path


def test_a_new_map_does_not_keep_places_of_another_frame(nodes: NodeRunner) -> None:
    path = map_with_place_and_zone(nodes, "hall")
    in_launch(nodes, mapping=True)
    shown = outcome(nodes, "hall", hall(20), {}, replace=True)
    assert OTHER_FRAME in shown and f"map_file:={path}" in shown
    assert not places_path(path).exists() and not zones_path(path).exists()
    versions_of(path, zones_path(path)).restore()
    assert free_rows("hall") == 10 and list(load_entries(places_path(path))) == ["bar"]
    assert zones_path(path).exists()


def test_undo_takes_back_a_map_with_the_places_of_its_launch(nodes: NodeRunner) -> None:
    path = map_with_place_and_zone(nodes, "hall")
    path.with_suffix(".bundle").write_bytes(b"a drive")
    in_launch(nodes, mapping=False)
    outcome(nodes, "hall", hall(20), {"desk": SE2(0.5, 0.5, 0.0)}, replace=True)
    assert list(load_entries(places_path(path))) == ["desk"] and not path.with_suffix(".bundle").exists()
    versions_of(path, zones_path(path)).restore()
    assert free_rows("hall") == 10 and list(load_entries(places_path(path))) == ["bar"]
    assert path.with_suffix(".bundle").read_bytes() == b"a drive"


def test_a_continued_map_keeps_its_places_and_zones(nodes: NodeRunner) -> None:
    path = map_with_place_and_zone(nodes, "hall")
    in_launch(nodes, mapping=True, map_file=str(path))
    assert OTHER_FRAME not in outcome(nodes, "hall", hall(20), {}, replace=True)
    assert list(load_entries(places_path(path))) == ["bar"] and zones_path(path).exists()
    # also under another name, whose own ones are of another map
    other = map_with_place_and_zone(nodes, "cellar")
    save_places(places_path(other), {"wine": SE2(0.1, 0.1, 0.0)})
    assert OTHER_FRAME in outcome(nodes, "cellar", hall(20), {}, replace=True)
    assert list(load_entries(places_path(other))) == ["bar"]


def test_a_map_begun_after_a_reset_has_another_frame(nodes: NodeRunner) -> None:
    path = map_with_place_and_zone(nodes, "hall")
    in_launch(nodes, mapping=True, map_file=str(path))
    device(nodes)._execute_mapping(do.ResetMap(), None, {})
    assert OTHER_FRAME in outcome(nodes, "hall", hall(20), {}, replace=True)


KEPT = encode_drives(
    GmappingParams(),
    [],
    {"map.yaml": encode_map_yaml("map.pgm", hall(12).grid), "map.pgm": encode_pgm(hall(12).grid)},
)
"""A bundle as the map recorder writes it, with a map that is not the one that is shown."""


def in_launch(nodes: NodeRunner, *, mapping: bool, map_file: str = "") -> None:
    nodes.loop.publish("launch_status", LaunchStatus("any", mapping, map_file), "launcher", latched=True)
    nodes.run(0.1)


def in_recorded_launch(nodes: NodeRunner, folder: Path) -> None:
    """Begin a mapping launch with a map recorder that writes to a folder."""
    in_launch(nodes, mapping=True)
    answer = MapFolder(str(folder))
    nodes.loop.subscribe(
        "map_recorder/write",
        "recorder",
        lambda _: nodes.loop.publish("map_recorder/written", answer, "recorder"),  # type: ignore[arg-type]
    )


def test_a_map_is_saved_with_its_drive(nodes: NodeRunner, tmp_path: Path) -> None:
    """And a later one of the same name, of which no drive is kept, without that of the one before."""
    folder, bundle = tmp_path / "kept", maps_folder() / "hall.bundle"
    folder.mkdir()
    (folder / "map.bundle").write_bytes(KEPT)
    in_launch(nodes, mapping=True)
    requests: list[Empty] = []

    def recorder(message: Empty) -> None:
        requests.append(message)
        nodes.loop.publish("map_recorder/written", MapFolder(str(folder)), "recorder")

    nodes.loop.subscribe("map_recorder/write", "recorder", recorder)  # type: ignore[arg-type]
    assert NO_DRIVE not in outcome(nodes, "hall")
    assert len(requests) == 1 and bundle.read_bytes() == KEPT
    assert free_rows("hall") == 12
    (folder / "map.bundle").unlink()
    assert NO_DRIVE in outcome(nodes, "hall", replace=True)
    assert len(requests) == 2 and not bundle.exists()


def test_a_launch_that_keeps_no_map_has_no_drive_to_wait_for(nodes: NodeRunner) -> None:
    launch = Launch(name="explore", description="", args={"keep_map": False}, nodes={})
    nodes.loop.publish(LAUNCH_TOPIC, String(launch.to_json()), "chefbot", latched=True)
    in_launch(nodes, mapping=True)
    assert NO_DRIVE in outcome(nodes, "hall")
    assert nodes.messages("map_recorder/write") == []


@pytest.mark.parametrize("kept", [True, False])
def test_a_map_is_sent_with_its_drive(nodes: NodeRunner, tmp_path: Path, kept: bool) -> None:
    """Or without one, if the recorder keeps none."""
    if kept:
        (tmp_path / "map.bundle").write_bytes(KEPT)
    in_recorded_launch(nodes, tmp_path)
    device(nodes)._execute_mapping(do.SendMap("7"), MAP, {})
    wait_for(lambda: nodes.run(0.1) or "map_bundle" in device(nodes)._server.layers)
    view = device(nodes)._server.layers["map_bundle"]
    assert view.id == "7" and base64.b64decode(view.bundle) == (KEPT if kept else b"")


@pytest.mark.parametrize("size", [0, 100])
def test_a_damaged_bundle_saves_nothing(nodes: NodeRunner, tmp_path: Path, size: int) -> None:
    (tmp_path / "map.bundle").write_bytes(KEPT[:size])
    in_recorded_launch(nodes, tmp_path)
    assert outcome(nodes, "hall").startswith("The map was not saved: ")
    assert not (maps_folder() / "hall.yaml").exists()


def test_a_recorder_that_does_not_answer_costs_the_drive_only(nodes: NodeRunner) -> None:
    in_launch(nodes, mapping=True)
    assert outcome(nodes, "hall").startswith("Saved.")
    assert list(maps_folder().glob("*.bundle")) == []


def test_a_map_with_its_drive_beside_it_can_be_continued(nodes: NodeRunner, tmp_path: Path) -> None:
    map_file = tmp_path / "hall.yaml"
    in_launch(nodes, mapping=False, map_file=str(map_file))
    assert device(nodes)._server.layers["launch"] == LaunchView(mapping=False)
    map_file.with_suffix(".bundle").write_bytes(KEPT)
    in_launch(nodes, mapping=False, map_file=str(map_file))
    assert device(nodes)._server.layers["launch"] == LaunchView(mapping=False, can_continue=True)


def test_another_launch_is_requested(nodes: NodeRunner, tmp_path: Path) -> None:
    device(nodes)._request_launch(do.MapBuilding())
    nodes.run(0.1)
    assert nodes.messages("launch_request") == []  # nothing is there that could run it
    in_launch(nodes, mapping=False, map_file=str(tmp_path / "hall.yaml"))
    for command in (do.MapBuilding(), do.MapBuilding(True), do.DriveOnMap("roof")):
        device(nodes)._request_launch(command)
    nodes.run(0.1)
    assert [(one.launch, one.arguments) for one in nodes.messages("launch_request")] == [
        ("gmapping_demo", ()),
        ("gmapping_demo", (f"continue_map:={tmp_path / 'hall.bundle'}",)),
        ("waiter", (f"map_file:={maps_folder() / 'roof.yaml'}",)),
    ]
    assert device(nodes)._server.layers["launch"] == LaunchView(
        mapping=False, ends=True
    )  # for other browsers
    in_launch(nodes, mapping=False, map_file=str(tmp_path / "hall.yaml"))
    assert device(nodes)._server.layers["launch"] == LaunchView(mapping=False), "the request was refused"


def test_the_saved_map_is_known_after_a_restart(nodes: NodeRunner) -> None:
    outcome(nodes, "hall")
    [saved] = nodes.messages("saved_map")
    assert saved.data == "hall" and [one.topic for one in nodes.loop.latched()].count("saved_map") == 1
    restarted = NodeRunner({"page": f"{__name__}:Surveyor"}, {"saved_map": saved})
    restarted.loop.publish("exploration_status", ExplorationStatus(Header(), True, 0, "Ready."), "explorer")
    restarted.run(0.1)
    assert device(restarted)._server.layers["mapping"].saved == "hall"


def test_the_search_on_a_continued_map_is_displayed(nodes: NodeRunner) -> None:
    nodes.loop.publish("scan/notice", String("The mapper looks for the robot."), "gmapping")
    nodes.run(0.1)
    assert "mapping" not in device(nodes)._server.layers  # localization reports there as well
    nodes.loop.publish("exploration_status", ExplorationStatus(Header(), True, 2, "Ready."), "explorer")
    nodes.run(0.1)
    assert device(nodes)._server.layers["mapping"].mapper == "The mapper looks for the robot."
    nodes.loop.publish("scan/notice", String("The robot is at x 1.00 m."), "gmapping")
    nodes.run(0.1)
    assert device(nodes)._server.layers["mapping"].mapper == "The robot is at x 1.00 m."


def test_orders_and_the_status_are_passed_on(nodes: NodeRunner) -> None:
    device(nodes)._execute_mapping(do.Explore(True), None, {})
    device(nodes)._execute_mapping(do.ResetMap(), None, {})
    nodes.loop.publish("exploration_status", ExplorationStatus(Header(), False, 2, "Exploring."), "explorer")
    nodes.run(0.1)
    assert nodes.messages("explore")[-1].data is True and len(nodes.messages("reset_map")) == 1
    assert device(nodes)._server.layers["mapping"] == MappingView(exploring=True, description="Exploring.")
