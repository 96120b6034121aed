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
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.launch import Launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node import NoParams
from chefbot.runtime.node_container import LAUNCH_TOPIC
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_entries, places_path
from chefbot.ui import commands as do
from chefbot.ui.display.views import MappingView
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


def test_orders_and_the_status_are_passed_on(nodes: NodeRunner) -> None:
    device(nodes)._execute_mapping(do.Explore(True), None, {})
    device(nodes)._execute_mapping(do.ResetMap(), None, {})
    nodes.loop.publish("exploration_status", ExplorationStatus(Header(), False, 2, "Exploring."), "explorer")
    nodes.run(0.1)
    assert nodes.messages("explore")[-1].data is True and len(nodes.messages("reset_map")) == 1
    assert device(nodes)._server.layers["mapping"] == MappingView(exploring=True, description="Exploring.")
