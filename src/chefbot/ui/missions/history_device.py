"""Base of the web UI's device: keeps the history of the robot's deliveries."""

from __future__ import annotations

from pathlib import Path

from chefbot.devices.state_files import state_folder
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Places
from chefbot.runtime.node import In
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.delivery_history import DeliveryHistory, RecordedRound
from chefbot.ui.missions.mission_device import MissionDevice
from chefbot.ui.missions.round_recorder import RoundRecorder

SHOWN_ROUNDS = 20
"""Number of rounds that the web UI shows, the newest."""


def history_path(robot: str) -> Path:
    """Return the file with the history of a robot's deliveries."""
    return state_folder() / "history" / f"{robot}.sqlite"


class HistoryDevice(MissionDevice):
    """Records each delivery round while the web UI is served; a history that cannot be written is a notice."""

    places: In[Places]
    _history: DeliveryHistory | None = None
    _recorder: RoundRecorder | None = None

    def stop(self) -> None:
        """Close the file with the history."""
        super().stop()
        if self._history is not None:
            self._history.close()

    def _open_history(self, *, simulated: bool) -> tuple[RecordedRound, ...]:
        """Open the history of the robot and return its newest rounds; `simulated` is noted with each new one."""
        try:
            self._history = DeliveryHistory(history_path(self.robot.name))
            self._recorder = RoundRecorder(self._history, self._labels, simulated=simulated)
        except StorageError as error:
            self._warn(str(error))
        return self._newest_rounds()

    def _labels(self) -> dict[str, str]:
        """Return the labels of the places that have one."""
        places = self.places.last.places if self.places.last else ()
        return {place.name: place.label for place in places if place.label}

    def _record_round(self, status: DeliveryStatus) -> bool:
        """Record what has changed, and return whether there is something new to show."""
        if self._recorder is None:
            return False
        try:
            return self._recorder.process(status)
        except StorageError as error:
            self._warn(str(error))
            self._recorder = None  # one sentence; the deliveries go on without it
            return False

    def _newest_rounds(self) -> tuple[RecordedRound, ...]:
        if self._history is None or self._recorder is None:
            return ()
        try:
            return tuple(reversed(self._history.rounds(SHOWN_ROUNDS)))
        except StorageError as error:  # a file that is damaged further inside
            self._warn(str(error))
            self._recorder = None
            return ()
