"""The web UI's device publishes what its operator changes in a simulated world."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.runtime.node import NoParams
from chefbot.ui import commands as do
from chefbot.ui.missions.simulation_device import SimulationDevice


class Hand(SimulationDevice):
    """The base class alone."""

    params: NoParams


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    runner = NodeRunner({"page": f"{__name__}:Hand"}, {})
    yield runner
    runner.system.stop()


def execute(nodes: NodeRunner, *commands: do.OperatorCommand) -> None:
    device: Any = nodes.system.nodes["page"]
    for command in commands:
        device._execute_in_simulation(command)
    nodes.run(0.1)


def test_poses_are_published_in_the_frame_of_the_map(nodes: NodeRunner) -> None:
    execute(nodes, do.DropBox(1.0, 2.0), do.Kidnap(3.0, 4.0, 0.5))
    (box,), (robot,) = nodes.messages("simulation/drop_box"), nodes.messages("simulation/kidnap")
    assert (box.pose.se2, robot.pose.se2) == (SE2(1.0, 2.0, 0.0), SE2(3.0, 4.0, 0.5))
    assert box.header.frame_id == robot.header.frame_id == "map"


def test_doors_are_opened_and_closed_by_name(nodes: NodeRunner) -> None:
    execute(nodes, do.OpenDoor("kitchen door"), do.CloseDoor("kitchen door"))
    assert [message.data for message in nodes.messages("simulation/door")] == [
        "open kitchen door",
        "close kitchen door",
    ]
