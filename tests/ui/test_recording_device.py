"""The web UI's device records from an order to the next one, and keeps what it has if the disk becomes full."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.support.nodes import NodeRunner
from tests.support.page_device import page_device
from tests.support.waiting import wait_for

from chefbot.incidents import files
from chefbot.incidents.files import read_incident
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import NoParams
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.storage.atomic_files import StorageError
from chefbot.ui.display.views import IncidentsView
from chefbot.ui.missions.incident_device import incident_folder
from chefbot.ui.missions.recording_device import RECORDING, RecordingDevice


class Scribe(RecordingDevice):
    """The base class alone; `shown` is the list of the web UI."""

    params: NoParams
    shown = IncidentsView()

    def _show_incidents(self, view: IncidentsView) -> None:
        self.shown = view


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    with page_device(f"{__name__}:Scribe", tmp_path, monkeypatch) as runner:
        yield runner


def device(nodes: NodeRunner) -> Any:
    return nodes.system.nodes["page"]


def talk(nodes: NodeRunner, text: str) -> None:
    nodes.loop.publish("chatter", String(text), "test")
    nodes.run(0.5)


def end(nodes: NodeRunner) -> IncidentsView:
    """End the recording, and return what the web UI then shows."""

    def ended() -> bool:
        nodes.run(0.1)
        return device(nodes).shown.recording_since is None

    device(nodes)._record("", "anna", on=False)
    wait_for(ended)
    shown: IncidentsView = device(nodes).shown
    return shown


def chatter(path: Path) -> list[str]:
    return [String.from_cdr(one.data).data for one in read_log(path).messages if one.topic == "chatter"]


def test_it_records_the_minute_before_and_what_follows(nodes: NodeRunner) -> None:
    talk(nodes, "before")
    device(nodes)._record("a door that sticks", "anna", on=True)
    assert device(nodes).shown.recording_since == pytest.approx(nodes.loop.now_ns / 1e9)
    assert device(nodes).shown.recorded_by
    talk(nodes, "during")
    device(nodes)._record("another", "ben", on=True)
    shown = end(nodes)
    talk(nodes, "after")
    (saved,) = shown.saved
    path = incident_folder() / saved.name
    assert chatter(path) == ["before", "during"] and shown.outcome == "Saved."
    incident = read_incident(path)
    assert incident is not None and (incident.sentence, incident.by) == ("a door that sticks", "anna")
    assert "chefbot/launch" in {one.topic for one in read_log(path).messages}, "with the configuration"


def test_the_end_of_the_launch_completes_the_file(nodes: NodeRunner) -> None:
    device(nodes)._record("", "", on=True)
    talk(nodes, "last")
    nodes.system.stop()
    (path,) = incident_folder().glob("*")
    incident = read_incident(path)
    assert chatter(path) == ["last"] and incident is not None and incident.sentence == RECORDING


def test_a_full_disk_keeps_what_was_written(nodes: NodeRunner, monkeypatch: pytest.MonkeyPatch) -> None:
    write = Recorder._write

    def full(self: Recorder, publication: Any) -> None:
        if isinstance(publication.message, String) and publication.message.data == "too much":
            self.close()
            raise StorageError("the disk is full")
        write(self, publication)

    monkeypatch.setattr(files.Recorder, "_write", full)
    device(nodes)._record("", "anna", on=True)
    for text in ("one", "too much", "two"):
        talk(nodes, text)
    shown = end(nodes)
    assert "The recording was not completed: the disk is full" in shown.outcome
    assert chatter(incident_folder() / shown.saved[0].name) == ["one"]
