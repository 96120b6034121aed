"""Base of the web UI's device: records why the robot slowed down, stopped or failed, over all of its runs."""

from __future__ import annotations

from chefbot.causes.history import CauseHistory
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import Cause, PresentCauses
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import Image
from chefbot.runtime.node import In, every, topic
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.cause_records import CauseRecords
from chefbot.storage.pending_writes import PendingWrites
from chefbot.ui.causes.cause_recorder import CauseRecorder
from chefbot.ui.causes.cause_views import KEPT_CAUSES, SHOWN_CAUSES, cause_views, recorded_cause_views
from chefbot.ui.display.views import CauseView
from chefbot.ui.missions.history_device import RETRY_RATE, history_path
from chefbot.ui.missions.recording_device import RecordingDevice

KEPT_MOMENTS = 50
"""Number of causes that are kept, with map and picture, while they cannot be written."""


class CauseDevice(RecordingDevice):
    """Keeps the causes of this run and records them; as long as that fails, a warning is shown."""

    causes: In[Cause]
    present_causes: In[PresentCauses]
    map: In[OccupancyGrid]
    picture: In[Image] = topic("camera/color/image_raw")
    _records: CauseRecords | None = None
    _cause_recorder: CauseRecorder | None = None
    _pending_causes: PendingWrites[tuple[Cause, Grid | None, Image | None]] | None = None

    def start(self) -> None:
        """Start this run without a cause."""
        super().start()
        self._causes = CauseHistory(size=KEPT_CAUSES)
        self._earlier_causes: tuple[CauseView, ...] = ()

    def stop(self) -> None:
        """Close the file with the history."""
        super().stop()
        if self._records is not None:
            self._records.close()

    def _open_causes(self, *, simulated: bool) -> tuple[CauseView, ...]:
        """Open the history of the robot and return the newest causes of its earlier runs."""
        self._simulated = simulated
        self._pending_causes = PendingWrites(self._write_cause, KEPT_MOMENTS)
        try:
            self._opened_cause_recorder()
        except StorageError as error:
            self._warn_of_history(str(error))
        return self._earlier_causes

    def _opened_cause_recorder(self) -> CauseRecorder:
        """Return the recorder, with the file open. Raises StorageError."""
        if self._records is None or self._cause_recorder is None:
            self._records = CauseRecords(history_path(self.robot.name))
            self._earlier_causes = recorded_cause_views(self._records.causes(SHOWN_CAUSES))
            radius = self.robot.footprint.circumscribed_radius
            self._cause_recorder = CauseRecorder(self._records, radius, simulated=self._simulated)
        return self._cause_recorder

    def _write_cause(self, moment: tuple[Cause, Grid | None, Image | None], time: str) -> bool:
        self._opened_cause_recorder().record(*moment, time)
        return True

    @every(hz=RETRY_RATE)
    def retry_causes(self) -> None:
        """Record what could not be written before."""
        if self._pending_causes:
            self._attempt(self._pending_causes.retry)

    def on_causes(self, cause: Cause) -> None:
        """Record and show why the robot slows down, stops, takes a detour or fails, or the end of that."""
        grid = self.map.last.grid if self.map.last else None
        self._show_causes(self._process_cause(cause, grid, self.picture.last))
        self._note_failure(cause)

    def on_present_causes(self, present: PresentCauses) -> None:
        """End the causes whose ends were lost."""
        for end in self._causes.lost_ends(present):
            self.on_causes(end)

    def _process_cause(self, cause: Cause, grid: Grid | None, picture: Image | None) -> tuple[CauseView, ...]:
        """Record a cause or the end of one, and return the causes to show, the newest first."""
        self._causes.process(cause)
        self._record_cause(cause, grid, picture)
        entries = self._cause_recorder.entries if self._cause_recorder is not None else {}
        return (cause_views(self._causes, entries) + self._earlier_causes)[:SHOWN_CAUSES]

    def _show_causes(self, causes: tuple[CauseView, ...]) -> None:
        """Show the causes, the newest first; for the web UI to implement."""

    def _record_cause(self, cause: Cause, grid: Grid | None, picture: Image | None) -> None:
        pending = self._pending_causes
        if pending is not None:
            self._attempt(lambda: pending.add((cause, grid, picture)))
