"""The web UI's device passes orders on to explorer and mapper, and saves maps under a name."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner
from tests.support.page_device import page_device
from tests.support.waiting import wait_for
from tests.ui.test_map_edit_device import Shown

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
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_entries, places_path
from chefbot.ui import commands as do
from chefbot.ui.display.views import LaunchView, MappingView
from chefbot.ui.editing import mapping_device
from chefbot.ui.editing.mapping_device import NO_MAP, MappingDevice, launch_arguments, maps_folder

MAP = OccupancyGrid.of(Header.of(0, "map"), Grid(np.full((20, 30), 100, np.int8), 0.05, 0.0, 0.0))


class Surveyor(MappingDevice):
    """The base class alone, with a server that only keeps its layers."""

    params: NoParams

    def start(self) -> None:
        super().start()
        self._server = Shown()  # type: ignore[assignment]


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    with page_device(f"{__name__}:Surveyor", tmp_path, monkeypatch) as runner:
        yield runner


def device(nodes: NodeRunner) -> Any:
    return nodes.system.nodes["page"]


def outcome(
    nodes: NodeRunner, name: str, newest: OccupancyGrid | None = MAP, *, replace: bool = False
) -> str:
    """Save a map and return what the web UI then shows."""
    before = device(nodes)._mapping.requests
    device(nodes)._execute_mapping(do.SaveMap(name, replace), newest, {"bar": SE2(0.5, 0.5, 0.0)})

    def ended() -> bool:
        nodes.run(0.1)
        return bool(device(nodes)._mapping.requests > before)

    wait_for(ended)
    return str(device(nodes)._server.layers["mapping"].outcome)


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
        ({}, ""),
    ],
)
def test_the_command_is_for_the_same_robot_and_world(args: dict[str, Any], text: str) -> None:
    launch = String(Launch(name="gmapping_demo", description="", args=args, nodes={}).to_json())
    assert launch_arguments([Publication(LAUNCH_TOPIC, launch, "chefbot", True, 0, True)]) == text
    assert launch_arguments([]) == ""


def test_a_map_is_replaced_only_on_request(nodes: NodeRunner) -> None:
    outcome(nodes, "hall")
    other = OccupancyGrid.of(Header.of(0, "map"), Grid(np.zeros((20, 30), np.int8), 0.05, 0.0, 0.0))
    assert outcome(nodes, "hall", other) == "There is a map called hall already."
    assert (load_map(maps_folder() / "hall.yaml").cells == 100).all()
    outcome(nodes, "hall", other, replace=True)
    assert (load_map(maps_folder() / "hall.yaml").cells == 0).all()


def test_what_cannot_be_saved_has_a_sentence(nodes: NodeRunner) -> None:
    assert outcome(nodes, "hall", None) == NO_MAP
    maps_folder().write_text("a file")
    assert outcome(nodes, "hall").startswith("The map was not saved: ")


DRIVE = b"a bundle"


def in_launch(nodes: NodeRunner, *, mapping: bool, map_file: str = "") -> None:
    nodes.loop.publish("launch_status", LaunchStatus("any", mapping, map_file), "launcher", latched=True)
    nodes.run(0.1)


def test_a_map_is_saved_with_its_drive(nodes: NodeRunner, tmp_path: Path) -> None:
    """And a later one of the same name, of which no drive is kept, without that of the one before."""
    folder, bundle = tmp_path / "kept", maps_folder() / "hall.bundle"
    folder.mkdir()
    (folder / "map.bundle").write_bytes(DRIVE)
    in_launch(nodes, mapping=True)
    requests: list[Empty] = []

    def recorder(message: Empty) -> None:
        requests.append(message)
        nodes.loop.publish("map_recorder/written", MapFolder(str(folder)), "recorder")

    nodes.loop.subscribe("map_recorder/write", "recorder", recorder)  # type: ignore[arg-type]
    outcome(nodes, "hall")
    assert len(requests) == 1 and bundle.read_bytes() == DRIVE
    (folder / "map.bundle").unlink()
    outcome(nodes, "hall", replace=True)
    assert len(requests) == 2 and not bundle.exists()


def test_a_recorder_that_does_not_answer_costs_the_drive_only(
    nodes: NodeRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mapping_device, "WRITE_TIMEOUT", 0.1)
    in_launch(nodes, mapping=True)
    assert outcome(nodes, "hall").startswith("Saved.")
    assert list(maps_folder().glob("*.bundle")) == []


def test_a_map_with_its_drive_beside_it_can_be_continued(nodes: NodeRunner, tmp_path: Path) -> None:
    map_file = tmp_path / "hall.yaml"
    in_launch(nodes, mapping=False, map_file=str(map_file))
    assert device(nodes)._server.layers["launch"] == LaunchView(mapping=False)
    map_file.with_suffix(".bundle").write_bytes(DRIVE)
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


def test_orders_and_the_status_are_passed_on(nodes: NodeRunner) -> None:
    device(nodes)._execute_mapping(do.Explore(True), None, {})
    device(nodes)._execute_mapping(do.ResetMap(), None, {})
    nodes.loop.publish("exploration_status", ExplorationStatus(Header(), False, 2, "Exploring."), "explorer")
    nodes.run(0.1)
    assert nodes.messages("explore")[-1].data is True and len(nodes.messages("reset_map")) == 1
    assert device(nodes)._server.layers["mapping"] == MappingView(exploring=True, description="Exploring.")
