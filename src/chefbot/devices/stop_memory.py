"""What a built robot remembers of STOP when its programs end, however they end: who was stopped starts stopped."""

from __future__ import annotations

import os
import queue
import threading
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.msgs.std_msgs import Bool, String
from chefbot.runtime.node import Device, In, Out, every, topic
from chefbot.storage.atomic_files import sync_folder

VARIABLE = "CHEFBOT_STATE"
ASK_HZ = 5.0
HOW = "Release STOP on a page, or say: chefbot topic pub --once /stop_request '{data: false}'"
STOPPED = f"The robot was stopped when its programs ended, and still is. {HOW}."
NOT_KNOWN = "It is not known whether the robot was stopped when its programs ended, so it is now"


def state_folder() -> Path:
    """CHEFBOT_STATE, else below the user's state (XDG_STATE_HOME, ~/.local/state)."""
    if own := os.environ.get(VARIABLE):
        return Path(own)
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "chefbot"


class StopFile:
    """An empty file whose name says it: to rename it needs no room on a disk, and is done wholly or not at all."""

    def __init__(self, folder: Path, robot: str) -> None:
        self._stopped, self._released = folder / f"{robot}.stopped", folder / f"{robot}.released"

    def read(self) -> bool:
        """False for a robot that was never started; it is kept from now on. OSError where that cannot be done."""
        self._stopped.parent.mkdir(parents=True, exist_ok=True)
        if self._stopped.exists():
            return True
        self._released.touch()
        return False

    def write(self, stopped: bool) -> None:
        """On the disk when this returns. OSError if not."""
        before, after = (self._released, self._stopped) if stopped else (self._stopped, self._released)
        if after.exists() and not before.exists():
            return
        before.touch()
        before.replace(after)
        sync_folder(after.parent)


class StopMemoryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Whose."""

    robot: Annotated[str, Meta(description="its namespace; empty where there is none")] = ""


class StopMemoryDevice(Device):
    """Keeps on disk whether the robot is stopped, and asks for STOP at the start if it was, or if nobody can know.

    A power cut or `kill -9` releases no STOP (ISO 3691-4, 4.1.14: no automatic restart). The disk is waited for in a
    thread of its own.
    """

    params: StopMemoryParams
    emergency_stop: In[Bool]
    stop_request: Out[Bool]
    remark: Out[String] = topic("stop_memory/remark")

    def start(self) -> None:
        """Look."""
        self._file = StopFile(state_folder(), self.params.robot.strip("/").replace("/", "_") or "robot")
        self._asks = False
        try:
            why = STOPPED if self._file.read() else ""
        except OSError as error:
            why = f"{NOT_KNOWN} ({error.filename}: {error.strerror}). {HOW}."
        if why:
            self._asks = True
            self.post(partial(self.remark.publish, String(why)))
            self.post(self.ask)
        self._wanted: queue.SimpleQueue[bool | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="stop memory", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """What was said last is on the disk."""
        super().stop()
        self._wanted.put(None)
        self._thread.join()

    def on_emergency_stop(self, stopped: Bool) -> None:
        """Keep it; what the base says before it has heard of the life before is nothing to keep."""
        self._asks = self._asks and not stopped.data
        if not self._asks:
            self._wanted.put(stopped.data)

    @every(hz=ASK_HZ)
    def ask(self) -> None:
        """Until the base says that it is stopped."""
        if self._asks:
            self.stop_request.publish(Bool(True))

    def _write(self) -> None:
        """In the thread."""
        while (stopped := self._wanted.get()) is not None:
            try:
                self._file.write(stopped)
            except OSError as error:
                state = "stopped" if stopped else "released"
                why = f"Warning: that the robot is {state} cannot be kept: {error.strerror}."
                self.post(partial(self.remark.publish, String(why)))
