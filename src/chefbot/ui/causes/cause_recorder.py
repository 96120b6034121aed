"""Records the causes of a run in the robot's history, stops and failures with pictures."""

from __future__ import annotations

import re

from chefbot.causes.reports import EMERGENCY_STOP, END, FAILURE, STOP
from chefbot.causes.sentences import effect_word
from chefbot.errors import ScanError
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.sensor_msgs import Image
from chefbot.scan.color_image import rgb_pixels
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.cause_records import CauseRecords, Moment
from chefbot.ui.causes.cause_views import HistoryEntry, place_on_map
from chefbot.ui.causes.map_snapshot import map_snapshot
from chefbot.ui.image_encoding import jpeg

PICTURE_INTERVAL_NS = 1_000_000_000
"""Minimum time between the pictures of two causes, ns."""
REPEAT_NS = 60_000_000_000
"""Time within which a cause with the effect and the sentence of another one is no new entry, ns."""
RECOVERY_NUMBER = re.compile(r"^Recovery \d+")


class CauseRecorder:
    """Records causes and their ends; `radius` is that of the robot, m."""

    def __init__(self, records: CauseRecords, radius: float, *, simulated: bool) -> None:
        self._records, self._radius, self._simulated = records, radius, simulated
        self._began_ns: dict[int, int] = {}
        self._lasted_ns: dict[int, int] = {}
        """How long the causes of each entry lasted together; between them the robot drove."""
        self._pictured_ns: int | None = None
        self._recent: dict[tuple[str, str], Cause] = {}
        """The causes of the last minute by what repeats of them."""
        self.entries: dict[int, HistoryEntry] = {}
        """The entries of the causes of this run by their `id`."""

    def record(self, cause: Cause, grid: Grid | None, picture: Image | None, time: str) -> None:
        """Record a cause with the newest map and picture of the camera, or the end of one.

        time: UTC, ISO 8601. Raises StorageError if that cannot be written; then nothing has changed, and it may be
        tried again.
        """
        before = dict(self._recent), self._pictured_ns, dict(self.entries), dict(self._lasted_ns)
        try:
            with self._records.changes_of(time):
                if cause.kind == END:
                    self._end(cause)
                else:
                    self._begin(cause, grid, picture)
        except StorageError:
            self._recent, self._pictured_ns, self.entries, self._lasted_ns = before
            raise

    def _end(self, end: Cause) -> None:
        if end.id in self.entries:
            number = self.entries[end.id].number
            self._lasted_ns[number] += end.header.stamp.ns - self._began_ns[end.id]
            self._records.end(number, self._lasted_ns[number] / 1e9)

    def _begin(self, cause: Cause, grid: Grid | None, picture: Image | None) -> None:
        """Record a cause, or add it to the entry of the same one within the last minute; people press each STOP."""
        now_ns, key = cause.header.stamp.ns, _repeated_part(cause)
        self._began_ns[cause.id] = now_ns
        self._recent = {
            one: before
            for one, before in self._recent.items()
            if 0 <= now_ns - before.header.stamp.ns < REPEAT_NS
        }
        before = self._recent.get(key)
        self._recent[key] = cause
        if before is not None and cause.check != EMERGENCY_STOP and before.id in self.entries:
            self.entries[cause.id] = self.entries[before.id]
            return
        moment = self._moment(cause, grid, picture)
        number = self._records.add(moment, simulated=self._simulated)
        self.entries[cause.id] = HistoryEntry(number, moment.pictures)
        self._lasted_ns[number] = 0

    def _moment(self, cause: Cause, grid: Grid | None, picture: Image | None) -> Moment:
        place = place_on_map(cause)
        x, y = place or (None, None)
        has_pictures = self._takes_pictures(cause)
        return Moment(
            effect=effect_word(cause),
            sentence=cause.sentence,
            chain=cause.chain,
            x=x,
            y=y,
            map=map_snapshot(grid, cause.robot.se2, self._radius, place)
            if has_pictures and grid is not None and cause.header.frame_id == "map"
            else b"",
            camera=_encoded(picture) if has_pictures else b"",
        )

    def _takes_pictures(self, cause: Cause) -> bool:
        """Return whether a cause is severe enough for pictures, and the last ones are old enough."""
        now_ns, last_ns = cause.header.stamp.ns, self._pictured_ns
        is_due = last_ns is None or not 0 <= now_ns - last_ns < PICTURE_INTERVAL_NS
        if cause.kind not in (STOP, FAILURE) or not is_due:
            return False
        self._pictured_ns = now_ns
        return True


def _repeated_part(cause: Cause) -> tuple[str, str]:
    """Return the effect of a cause and its sentence, without the number of a recovery."""
    return cause.kind, RECOVERY_NUMBER.sub("Recovery", cause.sentence)


def _encoded(picture: Image | None) -> bytes:
    """Return the picture as JPEG; empty without one, or for one of another encoding."""
    if picture is None:
        return b""
    try:
        return jpeg(rgb_pixels(picture))
    except (InvalidMessageError, ScanError):
        return b""
