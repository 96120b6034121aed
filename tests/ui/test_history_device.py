"""The web UI's device with its history: a damaged file is a notice, never a web UI that does not start."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.runtime.node import NoParams
from chefbot.storage.delivery_history import DeliveryHistory
from chefbot.ui.missions.history_device import HistoryDevice, history_path


class Historian(HistoryDevice):
    """The base class alone."""

    params: NoParams


def damage_rows(path: Path) -> None:
    """Overwrite all pages but the first, which has the tables' names and the version."""
    history = DeliveryHistory(path)
    for number in range(200):
        history.begin(str(number), "anna", ("table_1",), simulated=False)
    history.close()
    data = path.read_bytes()
    path.write_bytes(data[:4096] + b"\xff" * (len(data) - 4096))


def test_a_history_damaged_inside_is_a_notice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    nodes = NodeRunner({"page": f"{__name__}:Historian"}, {})
    device: Any = nodes.system.nodes["page"]
    path = history_path(device.robot.name)
    damage_rows(path)
    assert device._open_history(simulated=False) == ()
    under_way = DeliveryStatus(state="driving", place="kitchen", places=("table_1",), order_id="a")
    assert not device._record_round(under_way), "nothing is written into a damaged file"
    nodes.run(1.0)
    (notice,) = nodes.messages("page/notice")
    assert "the history" in notice.data and "cannot be used" in notice.data
    assert device.own_warnings == [notice.data.removeprefix("Warning: ").removesuffix(".")]
    nodes.system.stop()
