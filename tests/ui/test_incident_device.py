"""The web UI's device saves the last minute: on order, after a failure, and never twice at once."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.support.nodes import NodeRunner
from tests.support.waiting import PATIENCE

from chefbot.incidents.files import read_incident
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.node import NoParams
from chefbot.runtime.recorded_log import read_log
from chefbot.storage.atomic_files import StorageError
from chefbot.ui.display.views import IncidentsView
from chefbot.ui.missions import incident_device
from chefbot.ui.missions.incident_device import IncidentDevice, incident_folder


class Witness(IncidentDevice):
    """The base class alone; `shown` is the list of the web UI."""

    params: NoParams
    shown = IncidentsView()

    def _show_incidents(self, view: IncidentsView) -> None:
        self.shown = view


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    runner = NodeRunner({"page": f"{__name__}:Witness"}, {})
    yield runner
    runner.system.stop()


def device(nodes: NodeRunner) -> Any:
    return nodes.system.nodes["page"]


def files(nodes: NodeRunner) -> list[Path]:
    """The saved files, once nothing is being written."""
    if (writing := device(nodes)._writing) is not None:
        writing.join()
    nodes.run(0.1)
    return sorted(incident_folder().glob("*"))


def failed(nodes: NodeRunner, sentence: str, kind: str = "failure") -> None:
    device(nodes)._note_failure(Cause(Header.of(nodes.loop.now_ns, "map"), kind=kind, sentence=sentence))


def test_an_order_saves_the_last_minute(nodes: NodeRunner) -> None:
    for number in range(3):
        nodes.loop.publish("chatter", String(str(number)), "test")
        nodes.run(1.0)
    device(nodes)._save_incident("A box.", "anna")
    (path,) = files(nodes)
    incident = read_incident(path)
    assert incident is not None and (incident.sentence, incident.by) == ("A box.", "anna")
    topics = [message.topic for message in read_log(path).messages]
    assert topics.count("chatter") == 3 and "chefbot/launch" in topics, "with the configuration"
    shown = device(nodes).shown
    assert [one.name for one in shown.saved] == [path.name]
    assert (shown.outcome, shown.requests) == ("Saved.", 1)


def test_a_note_cannot_control_a_terminal(nodes: NodeRunner) -> None:
    device(nodes)._save_incident("A \x1b[31mred\n\x00 \u202ebox", "anna")
    (path,) = files(nodes)
    incident = read_incident(path)
    assert incident is not None and incident.sentence == "A [31mred box"


def test_a_failure_is_saved_with_what_follows(nodes: NodeRunner) -> None:
    device(nodes)._saves_failures = True
    failed(nodes, "No path to table 3.")
    failed(nodes, "No path to table 4.")
    failed(nodes, "Slower.", kind="slow")
    nodes.run(1.0)
    assert files(nodes) == []
    nodes.loop.publish("chatter", String("what followed"), "test")
    nodes.run(3.0)
    (path,) = files(nodes)
    incident = read_incident(path)
    assert incident is not None and (incident.sentence, incident.by) == ("No path to table 3.", "")
    assert "chatter" in [message.topic for message in read_log(path).messages]


def test_a_failure_is_not_saved_unless_that_is_set(nodes: NodeRunner) -> None:
    failed(nodes, "No path to table 3.")
    nodes.run(10.0)
    assert files(nodes) == []


def test_a_disk_that_is_full_is_a_notice(nodes: NodeRunner, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise StorageError("x.mcap cannot be written: No space left on device")

    monkeypatch.setattr(incident_device, "save_incident", full)
    device(nodes)._save_incident("A box.", "anna")
    assert files(nodes) == []
    (notice,) = nodes.messages("page/notice")
    assert "The incident was not saved: x.mcap cannot be written: No space left" in notice.data
    shown = device(nodes).shown
    assert shown.outcome.startswith("The incident was not saved: ") and shown.requests == 1


def test_one_is_saved_at_a_time(nodes: NodeRunner, monkeypatch: pytest.MonkeyPatch) -> None:
    free, began = threading.Event(), threading.Event()
    monkeypatch.setattr(incident_device, "save_incident", lambda *_: (began.set(), free.wait()))
    device(nodes)._save_incident("One.", "anna")
    assert began.wait(PATIENCE)
    device(nodes)._save_incident("Two.", "anna")
    free.set()
    assert files(nodes) == []
    (notice,) = nodes.messages("page/notice")
    assert "is being saved already" in notice.data
    assert device(nodes).shown.requests == 2, "each request ends with a sentence"


def test_a_stopped_device_keeps_nothing(nodes: NodeRunner) -> None:
    minute = device(nodes)._minute
    nodes.system.stop()
    before = len(minute.content())
    nodes.loop.publish("chatter", String("late"), "test")
    assert len(minute.content()) == before
