"""Tests that the web UI lists the doors of a simulated world and moves them."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from tests.chaos.launch_process import free_port
from tests.support.waiting import PATIENCE

from chefbot.msgs.sensor_msgs import JointState
from chefbot.msgs.validity import check
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import PacedClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.ui.commands import CloseDoor, OpenDoor
from chefbot.ui.display.message_conversion import door_views
from chefbot.ui.remote.web_ui_client import WebUiClient


@pytest.fixture
def client(request: pytest.FixtureRequest) -> Iterator[WebUiClient]:
    system = NodeContainer(Loop(PacedClock(1.0)), load_robot("chefbot_lidar"), 1)
    nodes = {
        "page": NodeEntry(
            kind="chefbot.ui.web_ui:WebUiDevice", params={"port": free_port(), "simulation": True}
        ),
        "simulator": NodeEntry(
            kind="chefbot.sim.device:SimulatorDevice", params={"world": request.param, "people": 0}
        ),
    }
    system.launch(Launch(name="test", description="", args={}, nodes=nodes))
    thread = threading.Thread(target=system.loop.run)
    thread.start()
    try:
        with WebUiClient(system.nodes["page"].url) as connected:  # type: ignore[attr-defined]
            yield connected
    finally:
        system.loop.stop()
        thread.join()
        system.stop()


def door_states(client: WebUiClient) -> dict[str, bool]:
    status = client.latest.get("status") or {}
    return {door["name"]: door["open"] for door in status.get("doors", [])}


def receive_until(client: WebUiClient, door: str, is_open: bool) -> None:
    for _ in range(1000):
        if door_states(client).get(door) is is_open:
            return
        client.receive(PATIENCE)
    raise AssertionError(f"{door} is not {'open' if is_open else 'closed'}: {door_states(client)}")


@pytest.mark.parametrize("client", ["hotel"], indirect=True)
@pytest.mark.slow
def test_a_door_is_listed_and_closes_and_opens_by_command(client: WebUiClient) -> None:
    receive_until(client, "door_101", True)
    assert set(door_states(client)) == {"kitchen_door", "door_101", "door_102"}
    client.send(CloseDoor("door_101"))
    receive_until(client, "door_101", False)
    assert door_states(client)["door_102"]
    client.send(OpenDoor("door_101"))
    receive_until(client, "door_101", True)


@pytest.mark.parametrize("client", ["room"], indirect=True)
@pytest.mark.slow
def test_a_world_without_doors_offers_none(client: WebUiClient) -> None:
    while not (client.latest.get("status") or {}).get("clock", 0.0) > 1.0:
        client.receive(PATIENCE)
    assert door_states(client) == {}


def test_doors_without_positions_are_not_listed() -> None:
    doors = JointState(name=("door_101", "door_102"))
    check(doors)
    assert door_views(doors) == ()
