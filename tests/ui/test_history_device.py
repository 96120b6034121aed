"""The web UI's device with its history: a damaged file is a notice, never a web UI that does not start."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
from tests.support.nodes import NodeRunner

from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.runtime.node import NoParams
from chefbot.storage import history_file
from chefbot.storage.delivery_history import DeliveryHistory
from chefbot.storage.history_file import HistoryFile, utc_now
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


def fill_disk(history: HistoryFile, *, full: bool) -> None:
    """Let the file grow no more, as on a full disk; SQLite then reports the same error."""
    (pages,) = history._db.execute("PRAGMA page_count").fetchone()
    history._db.execute(f"PRAGMA max_page_count = {pages if full else 1_000_000}")


def test_what_a_full_disk_refused_is_recorded_later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    nodes = NodeRunner({"page": f"{__name__}:Historian"}, {})
    device: Any = nodes.system.nodes["page"]
    device._open_history(simulated=False)
    fill_disk(device._history, full=True)
    tables = tuple(f"a_table_with_a_long_name_{number:030d}" for number in range(300))
    round_ = DeliveryStatus(state="driving", place="kitchen", places=tables, order_id="a", ordered_by="anna")
    for status in (
        round_,
        msgspec.structs.replace(round_, loaded=True, delivered=tables[:1]),
        msgspec.structs.replace(round_, loaded=True, delivered=tables),
        DeliveryStatus(state="idle", places=tables, delivered=tables, last_outcome="All places were served."),
    ):
        assert not device._record_round(status) and device._newest_rounds() == ()
    nodes.run(12.0)
    assert [warning.endswith("disk is full") for warning in device.own_warnings] == [True]
    failed_at = utc_now()
    fill_disk(device._history, full=False)
    monkeypatch.setattr(history_file, "utc_now", lambda: "2099-01-01T00:00:00+00:00")
    nodes.run(6.0)
    (recorded,) = device._newest_rounds()
    assert {stop.outcome for stop in recorded.stops} == {"taken"} and recorded.ordered_by == "anna"
    assert recorded.outcome == "All places were served." and device.own_warnings == []
    times = (recorded.began, recorded.ended, *(stop.at for stop in recorded.stops))
    assert all(time <= failed_at for time in times), "when it happened, not when there was room"
    nodes.system.stop()


def test_a_history_that_cannot_be_opened_is_opened_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    (tmp_path / "history").write_text("a file in the place of the folder")
    nodes = NodeRunner({"page": f"{__name__}:Historian"}, {})
    device: Any = nodes.system.nodes["page"]
    assert device._open_history(simulated=False) == ()
    device._record_round(DeliveryStatus(state="driving", place="kitchen", places=("table_1",), order_id="a"))
    nodes.run(1.0)
    assert device.own_warnings
    (tmp_path / "history").unlink()
    nodes.run(6.0)
    assert len(device._newest_rounds()) == 1 and device.own_warnings == []
    nodes.system.stop()


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
