"""Base of the web UI's device: saves the last minute as an incident, on order or after a failure."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec

from chefbot.causes.reports import FAILURE
from chefbot.devices.state_files import state_folder
from chefbot.incidents.buffer import IncidentBuffer
from chefbot.incidents.files import (
    Incident,
    SavedIncident,
    printable,
    remove_old,
    save_incident,
    saved_incidents,
)
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.std_msgs import String
from chefbot.runtime.loop import Publication
from chefbot.storage.atomic_files import StorageError
from chefbot.ui.display.views import IncidentsView
from chefbot.ui.missions.history_device import HistoryDevice

SHOWN_INCIDENTS = 20
"""Number of incidents that the web UI shows, the newest."""
AFTERMATH = 3.0
"""Time after a failure that its incident contains, s."""
INTERVAL_NS = 60_000_000_000
"""Minimum time between two incidents that the robot saves itself, ns."""
PIECE, PAUSE = 50, 0.005
"""Number of messages that are written without a pause, and the pause, s."""


def incident_folder() -> Path:
    """Return the folder of the incidents of this computer's robots."""
    return state_folder() / "incidents"


def utc_now() -> str:
    """Return the time of the wall clock as 2026-01-31T09:05:00Z."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())


class IncidentDevice(HistoryDevice):
    """Keeps the last minute of what the web UI subscribes; a thread saves it, so that nothing waits for the disk."""

    def start(self) -> None:
        """Start to keep what is published from now on."""
        super().start()
        self._minute = IncidentBuffer()
        self._saves_failures = False
        self._saved_ns: int | None = None
        self._writing: threading.Thread | None = None
        self._incidents = IncidentsView(saved=self._newest_incidents())
        for publication in self.context.loop.latched():  # such as the launch, which is the configuration
            self._minute(publication)
        self.context.loop.add_observer(self._minute)

    def stop(self) -> None:
        """Finish what is being written."""
        self.context.loop.remove_observer(self._minute)
        super().stop()
        if self._writing is not None:
            self._writing.join()

    def _note_failure(self, cause: Cause) -> None:
        """Save an incident soon after a failure, so that it contains what followed."""
        now_ns = self.now_ns
        is_due = self._saved_ns is None or now_ns - self._saved_ns >= INTERVAL_NS
        if self._saves_failures and cause.kind == FAILURE and is_due:
            self._saved_ns = now_ns
            later_ns = now_ns + round(AFTERMATH * 1e9)
            self.schedule_at(later_ns, lambda: self._save_incident(cause.sentence, ""))

    def _save_incident(self, sentence: str, who: str) -> None:
        """Save the last minute; `who` gave the order, empty for the robot itself."""
        if self._writing is not None and self._writing.is_alive():
            self._end_request(
                self._incidents.saved, "An incident is being saved already; save again in a moment"
            )
            return
        incident = Incident(robot=self.robot.name, time=utc_now(), sentence=printable(sentence), by=who)
        content = self._minute.content()
        self._writing = threading.Thread(target=self._write, args=(incident, content), name="incident")
        self._writing.start()

    def _write(self, incident: Incident, content: list[Publication]) -> None:
        """Write the file, in the thread."""
        problem = ""
        try:
            save_incident(incident_folder(), incident, _in_pieces(content), self.robot, self.context.seed)
            remove_old(incident_folder(), self.robot.name)
        except (StorageError, OSError) as error:
            problem = f"The incident was not saved: {error}"
        saved = self._newest_incidents()
        self.post(lambda: self._end_request(saved, problem))

    def _end_request(self, saved: tuple[SavedIncident, ...], problem: str) -> None:
        """Show the newest incidents and how a request has ended; a problem is a notice, too."""
        if problem:
            self.notice.publish(String(f"Warning: {problem}."))
        outcome = f"{problem or 'Saved'}."
        view = msgspec.structs.replace(
            self._incidents, saved=saved, outcome=outcome, requests=self._incidents.requests + 1
        )
        self._incidents = view
        self._show_incidents(view)

    def _show_incidents(self, view: IncidentsView) -> None:
        """Show the incidents; for the web UI to implement."""

    def _newest_incidents(self) -> tuple[SavedIncident, ...]:
        try:
            return tuple(saved_incidents(incident_folder(), self.robot.name, SHOWN_INCIDENTS))
        except OSError as error:
            self._warn(f"the incidents cannot be read: {error}")
            return ()


def _in_pieces(content: list[Publication]) -> Iterator[Publication]:
    """Yield the publications with pauses, in which the event loop of this process runs."""
    for number, publication in enumerate(content):
        if number % PIECE == 0:
            time.sleep(PAUSE)
        yield publication
