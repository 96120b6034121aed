"""Base of the web UI's device: keeps the history of the robot's deliveries."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from chefbot.devices.state_files import state_folder
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Places
from chefbot.runtime.node import In, every
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.delivery_history import DeliveryHistory, RecordedRound
from chefbot.storage.pending_writes import PendingWrites
from chefbot.ui.missions.mission_device import MissionDevice
from chefbot.ui.missions.round_recorder import RoundRecorder

SHOWN_ROUNDS = 20
"""Number of rounds that the web UI shows, the newest."""
KEPT_STATUSES = 1000
"""Number of changes of the deliveries that are kept while they cannot be written."""
RETRY_RATE = 0.2
"""Rate at which that is tried again, Hz."""


def history_path(robot: str) -> Path:
    """Return the file with the history of a robot's deliveries."""
    return state_folder() / "history" / f"{robot}.sqlite"


class HistoryDevice(MissionDevice):
    """Records each delivery round while the web UI is served; as long as that fails, a warning is shown."""

    places: In[Places]
    _history: DeliveryHistory | None = None
    _recorder: RoundRecorder | None = None
    _pending_rounds: PendingWrites[DeliveryStatus] | None = None
    _newest: tuple[RecordedRound, ...] = ()
    _simulated = False
    _history_problem = ""

    def stop(self) -> None:
        """Close the file with the history."""
        super().stop()
        if self._history is not None:
            self._history.close()

    def _open_history(self, *, simulated: bool) -> tuple[RecordedRound, ...]:
        """Open the history of the robot and return its newest rounds; `simulated` is noted with each new one."""
        self._simulated = simulated
        self._pending_rounds = PendingWrites(self._write_round, KEPT_STATUSES)
        return self._newest_rounds()

    def _opened_recorder(self) -> RoundRecorder:
        """Return the recorder, with the file open. Raises StorageError."""
        if self._history is None or self._recorder is None:
            self._history = DeliveryHistory(history_path(self.robot.name))
            self._recorder = RoundRecorder(self._history, self._labels, simulated=self._simulated)
        return self._recorder

    def _write_round(self, status: DeliveryStatus, time: str) -> bool:
        return self._opened_recorder().process(status, time)

    def _labels(self) -> dict[str, str]:
        """Return the labels of the places that have one."""
        places = self.places.last.places if self.places.last else ()
        return {place.name: place.label for place in places if place.label}

    def _record_round(self, status: DeliveryStatus) -> bool:
        """Record what has changed, and return whether there is something new to show."""
        pending = self._pending_rounds
        return pending is not None and self._attempt(lambda: pending.add(status))

    @every(hz=RETRY_RATE)
    def retry_rounds(self) -> None:
        """Record what could not be written before."""
        if self._pending_rounds and self._attempt(self._pending_rounds.retry):
            self._show_history(self._newest_rounds())

    def _attempt(self, write: Callable[[], bool]) -> bool:
        """Write, and return whether anything has changed; a warning is shown until it works again."""
        try:
            changed = write()
        except StorageError as error:
            self._warn_of_history(str(error))
            return False
        self._warn_of_history("")
        return changed

    def _warn_of_history(self, problem: str) -> None:
        """Replace the warning about the history; an empty one ends it."""
        if problem != self._history_problem:
            self._end_warning(self._history_problem)
            self._history_problem = problem
            if problem:
                self._warn(problem)

    def _show_history(self, rounds: tuple[RecordedRound, ...]) -> None:
        """Show the rounds, the newest first; for the web UI to implement."""

    def _newest_rounds(self) -> tuple[RecordedRound, ...]:
        """Return the newest rounds; those of the last time if they cannot be read."""
        if self._pending_rounds is None:
            return ()
        try:
            self._opened_recorder()
            assert self._history is not None, "it is open"
            self._newest = tuple(reversed(self._history.rounds(SHOWN_ROUNDS)))
        except StorageError as error:  # a file that is damaged further inside
            self._warn_of_history(str(error))
        return self._newest
