"""The web UI's device shows the ROS graph while a page asks for it, and ends the inspection with itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.support.nodes import NodeRunner
from tests.support.waiting import wait_for
from tests.ui.test_map_edit_device import Shown

from chefbot.ros2.tools import inspector
from chefbot.ros2.tools.common import ToolError
from chefbot.runtime.node import NoParams
from chefbot.ui.access.audit_log import read_entries
from chefbot.ui.commands import Inspect, SetParameter
from chefbot.ui.inspect.inspect_device import InspectDevice


class Lens(InspectDevice):
    """The base class alone, with a server that only keeps its layers."""

    params: NoParams

    def start(self) -> None:
        super().start()
        self._server = Shown()  # type: ignore[assignment]


def test_a_page_that_looks_is_shown_the_graph(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, port: int
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", str(port))
    monkeypatch.setattr(inspector, "SEARCH", 0.1)
    nodes = NodeRunner({"page": f"{__name__}:Lens"}, {})
    device: Any = nodes.system.nodes["page"]

    def shown() -> bool:
        device._inspect(Inspect(["/odom"]), "anna")
        return {"graph", "values"} <= set(device._server.layers)  # each is shown when it is known

    wait_for(shown)
    assert device._server.layers["graph"].problem == inspector.NO_GRAPH
    assert device._server.layers["values"][0].name == "/odom"
    with pytest.raises(ToolError, match="At most 12"):
        device._inspect(Inspect([f"/a{number}" for number in range(12)]), "anna")
    with pytest.raises(ToolError, match="at most 4 nodes"):
        for number in range(5):
            device._inspect(SetParameter(f"/a{number}", "speed", 0.5), "anna")
    device._refusal_of(SetParameter("/base", "speed", 9.0), "anna")("too fast")
    nodes.system.stop()
    (entry,) = read_entries(device.audit.path)
    assert (entry.name, entry.action, entry.refused) == ("anna", "parameter refused", "too fast")
    assert device._inspector._thread is None
