"""Base of the web UI's device: records why the robot slowed down, stopped or failed, over all of its runs."""

from __future__ import annotations

from chefbot.causes.history import CauseHistory
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import Cause, PresentCauses
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import Image
from chefbot.runtime.node import In, topic
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.cause_records import CauseRecords
from chefbot.ui.causes.cause_recorder import CauseRecorder
from chefbot.ui.causes.cause_views import KEPT_CAUSES, SHOWN_CAUSES, cause_views, recorded_cause_views
from chefbot.ui.display.views import CauseView
from chefbot.ui.missions.history_device import history_path
from chefbot.ui.missions.recording_device import RecordingDevice


class CauseDevice(RecordingDevice):
    """Keeps the causes of this run and records them; a history that cannot be written is a notice."""

    causes: In[Cause]
    present_causes: In[PresentCauses]
    map: In[OccupancyGrid]
    picture: In[Image] = topic("camera/color/image_raw")
    _records: CauseRecords | None = None
    _cause_recorder: CauseRecorder | None = None

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
        try:
            self._records = CauseRecords(history_path(self.robot.name))
            self._earlier_causes = recorded_cause_views(self._records.causes(SHOWN_CAUSES))
            radius = self.robot.footprint.circumscribed_radius
            self._cause_recorder = CauseRecorder(self._records, radius, simulated=simulated)
        except StorageError as error:
            self._warn(str(error))
        return self._earlier_causes

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
        if self._cause_recorder is None:
            return
        try:
            self._cause_recorder.record(cause, grid, picture)
        except StorageError as error:
            self._warn(str(error))
            self._cause_recorder = None  # one sentence; the robot continues without it
