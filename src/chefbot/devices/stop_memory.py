"""Persistence of the emergency stop on a real robot: a robot that was stopped is stopped again after a
restart."""

from __future__ import annotations

import queue
import threading
from functools import partial
from pathlib import Path

from chefbot.devices.state_files import StateFileParams, state_folder
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus
from chefbot.msgs.std_msgs import Bool, String
from chefbot.runtime.node import Device, In, Out, every, topic
from chefbot.storage.atomic_files import sync_folder

REPEAT_HZ = 5.0
"""Rate of the repeated stop request, Hz."""
HOW_TO_RELEASE = "Release it in the web UI, or run: chefbot topic pub --once /stop_request '{data: false}'"
ESTOP_RESTORED = f"Emergency stop restored after the restart. {HOW_TO_RELEASE}."
ESTOP_STATE_UNKNOWN = "The emergency stop's state before the restart is unknown, so the robot is stopped"


class StopFile:
    """An empty file whose name is the state: a rename needs no disk space and is atomic."""

    def __init__(self, folder: Path, robot: str) -> None:
        self._stopped, self._released = folder / f"{robot}.stopped", folder / f"{robot}.released"

    def read(self) -> bool:
        """Return whether the robot was stopped; False for one that was never started, whose file is created.
        OSError where that fails."""
        self._stopped.parent.mkdir(parents=True, exist_ok=True)
        if self._stopped.exists():
            return True
        self._released.touch()
        return False

    def write(self, stopped: bool) -> None:
        """Store the state; it is on the disk when this returns. Raises OSError otherwise."""
        old, new = (self._released, self._stopped) if stopped else (self._stopped, self._released)
        if new.exists() and not old.exists():
            return
        # Rename the file atomically and sync the directory entry.
        old.touch()
        old.replace(new)
        sync_folder(new.parent)


class EmergencyStopStore(Device):
    """Stores on disk whether the robot is stopped, and requests the emergency stop at the start if it was, or
    if the state is unknown.

    A power failure or `kill -9` must not release an emergency stop (ISO 3691-4, 4.1.14: no automatic
    restart). A robot that only waited for its motor board was not stopped by anybody, and starts released. The disk
    is written in a separate thread.
    """

    params: StateFileParams
    stop_status: In[EmergencyStopStatus]
    stop_request: Out[Bool]
    notice: Out[String] = topic("stop_memory/notice")

    def start(self) -> None:
        """Read the stored state and request the emergency stop if needed."""
        self._file = StopFile(state_folder(), self.params.file_name(self.robot.name))
        self._requesting = False
        try:
            notice = ESTOP_RESTORED if self._file.read() else ""
        except OSError as error:
            notice = f"{ESTOP_STATE_UNKNOWN} ({error.filename}: {error.strerror}). {HOW_TO_RELEASE}."
        if notice:
            self._requesting = True
            self.post(partial(self.notice.publish, String(notice)))
            self.post(self.repeat_stop_request)
        self._states: queue.SimpleQueue[bool | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="stop memory", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Write the last state to the disk and end the thread."""
        super().stop()
        self._states.put(None)
        self._thread.join()

    def on_stop_status(self, status: EmergencyStopStatus) -> None:
        """Store the state; until the restored stop is confirmed, the drive base's state is not stored."""
        pressed = status.active and not status.held
        # The drive base reports "released" until it has processed the request: do not store that.
        self._requesting = self._requesting and not pressed
        if not self._requesting:
            self._states.put(pressed)

    @every(hz=REPEAT_HZ)
    def repeat_stop_request(self) -> None:
        """Request the emergency stop until the drive base confirms it."""
        if self._requesting:
            self.stop_request.publish(Bool(True))

    def _write(self) -> None:
        """Write states to the disk, in the separate thread."""
        while (stopped := self._states.get()) is not None:
            try:
                self._file.write(stopped)
            except OSError as error:
                state = "stopped" if stopped else "released"
                notice = f"Warning: that the robot is {state} cannot be kept: {error.strerror}."
                self.post(partial(self.notice.publish, String(notice)))
