"""Base of the web UI's device: records from an operator's order on, until another one."""

from __future__ import annotations

import threading

import msgspec

from chefbot.incidents.files import Incident, SavedIncident, printable, save_incident
from chefbot.incidents.recording import Recording
from chefbot.storage.atomic_files import StorageError
from chefbot.ui.missions.incident_device import IncidentDevice, incident_folder, utc_now

RECORDING = "A recording"
"""What a recording without a note is called."""


class RecordingDevice(IncidentDevice):
    """Writes what is published to a file while it is published; the file is listed with the incidents."""

    def start(self) -> None:
        """Start without a recording, until one is ordered."""
        super().start()
        self._recording: Recording | None = None
        self._recording_thread: threading.Thread | None = None

    def stop(self) -> None:
        """End the recording that is under way, and finish its file."""
        self._end_recording()
        if self._recording_thread is not None:
            self._recording_thread.join()
        super().stop()

    def _record(self, note: str, who: str, *, on: bool) -> None:
        """Begin a recording, or end it."""
        if not on:
            self._end_recording()
        elif self._recording is None:
            self._begin_recording(note, who)

    def _begin_recording(self, note: str, who: str) -> None:
        incident = Incident(
            robot=self.robot.name, time=utc_now(), sentence=printable(note) or RECORDING, by=who or "operator"
        )
        recording = Recording(self._minute.content(), incident_folder())
        self.context.loop.add_observer(recording)
        self._recording = recording
        self._recording_thread = threading.Thread(
            target=self._write_recording, args=(incident, recording), name="recording"
        )
        self._recording_thread.start()
        began = self.now_ns / 1e9
        self._incidents = msgspec.structs.replace(
            self._incidents, recording_since=began, recorded_by=incident.by
        )
        self._show_incidents(self._incidents)

    def _end_recording(self) -> None:
        if self._recording is not None:
            self.context.loop.remove_observer(self._recording)
            self._recording.end()
            self._recording = None

    def _write_recording(self, incident: Incident, recording: Recording) -> None:
        """Write the file, in the thread."""
        problem = ""
        try:
            save_incident(
                incident_folder(), incident, recording, self.robot, self.context.seed, keep_part=True
            )
        except (StorageError, OSError) as error:
            problem = f"The recording was not completed: {error}"
        saved = self._newest_incidents()
        self.post(lambda: self._finish_recording(saved, problem or recording.reason))

    def _finish_recording(self, saved: tuple[SavedIncident, ...], problem: str) -> None:
        self._end_recording()
        self._incidents = msgspec.structs.replace(self._incidents, recording_since=None)
        self._end_request(saved, problem)
