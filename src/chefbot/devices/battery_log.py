"""Persistence of what the battery monitor has learnt about a built robot: consumption and charge."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.devices.state_files import StateFileParams, read_state, state_folder, store_state
from chefbot.msgs.chefbot_msgs import BatteryLog
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Device, In, Out, topic
from chefbot.storage.atomic_files import StorageError

BROKEN = "{}: {}; the battery's consumption is that of the robot's sizing until it is learnt again."


class LogFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Content of the file: W, J per metre, s per metre, charge 0..1 (also by voltage alone), times learnt."""

    standing_power: Annotated[float, Meta(gt=0, le=10_000)]
    energy_per_metre: Annotated[float, Meta(gt=0, le=100_000)]
    seconds_per_metre: Annotated[float, Meta(gt=0, le=10_000)]
    charge: Annotated[float, Meta(ge=0, le=1)]
    measured: Annotated[float, Meta(ge=0, le=1)]
    windows: Annotated[int, Meta(ge=0, lt=2**32)]


class BatteryLogStore(Device):
    """Publishes the stored log of the battery at the start, and stores each new one atomically."""

    params: StateFileParams
    log: In[BatteryLog] = topic("battery/log")
    stored_log: Out[BatteryLog] = topic("battery/stored_log", latched=True)
    notice: Out[String] = topic("battery_log/notice")

    def start(self) -> None:
        """Read the file; a damaged one is one sentence in the terminal, and the sizing is used."""
        self._path = state_folder() / f"{self.params.file_name(self.robot.name)}.battery.json"
        self._last_notice = ""
        try:
            stored = read_state(self._path, LogFile)
        except (OSError, msgspec.MsgspecError, ValueError) as error:
            self._report(BROKEN.format(self._path, error))
            return
        if stored is not None:
            message = BatteryLog(**msgspec.structs.asdict(stored))
            self.post(partial(self.stored_log.publish, message))

    def on_log(self, log: BatteryLog) -> None:
        """Store a log; a full disk is reported once and costs only the log."""
        try:
            store_state(self._path, log_file(log))
        except StorageError as error:
            self._report(f"Warning: what was learnt about the battery cannot be kept: {error}")

    def _report(self, sentence: str) -> None:
        if sentence != self._last_notice:
            self._last_notice = sentence
            self.post(partial(self.notice.publish, String(sentence)))


def log_file(log: BatteryLog) -> LogFile:
    """Return the content of the file for a log."""
    return LogFile(**{name: getattr(log, name) for name in LogFile.__struct_fields__})
