"""The history of why a robot slowed down, stopped, took a detour or failed, with pictures of the moment."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path
from typing import Literal

import msgspec

from chefbot.storage.history_file import HistoryFile

MAX_KEPT = 1000
"""Number of causes that are kept, the newest."""
Picture = Literal["map", "camera"]


class RecordedCause(msgspec.Struct, frozen=True, kw_only=True):
    """A cause as it was recorded; `number` counts the causes of all runs of the robot."""

    number: int
    simulated: bool
    began: str
    """UTC in ISO 8601."""
    duration: float | None
    """How long it lasted on the robot's clock, s; None while it holds, or if the robot was switched off meanwhile."""
    effect: str
    sentence: str
    chain: tuple[str, ...]
    x: float | None
    y: float | None
    """Where the obstacle was on the map, m, or None."""
    pictures: tuple[Picture, ...]


class Moment(msgspec.Struct, frozen=True, kw_only=True):
    """A cause to record. Its pictures are a PNG of the map about the robot and a JPEG of the camera, or empty."""

    effect: str
    sentence: str
    chain: tuple[str, ...] = ()
    x: float | None = None
    y: float | None = None
    map: bytes = b""
    camera: bytes = b""

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """The kinds of its pictures that are not empty."""
        kinds: tuple[tuple[Picture, bytes], ...] = (("map", self.map), ("camera", self.camera))
        return tuple(kind for kind, content in kinds if content)


class CauseRecords(HistoryFile):
    """Reads and writes the causes of a history."""

    def add(self, moment: Moment, *, simulated: bool) -> int:
        """Record a cause that begins now, forget the oldest if there are too many, and return its number."""
        chain = json.dumps(moment.chain)
        with self._transaction():
            row = self._db.execute(
                "INSERT INTO causes (simulated, began, effect, sentence, chain, x, y, map, camera) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    simulated, self._now(), moment.effect, moment.sentence, chain,
                    moment.x, moment.y, moment.map or None, moment.camera or None,
                ),
            )  # fmt: skip
            number = int(row.lastrowid or 0)
            self._db.execute("DELETE FROM causes WHERE id <= ?", (number - MAX_KEPT,))
        return number

    def end(self, number: int, duration: float) -> None:
        """Note how long a cause lasted, s."""
        with self._transaction():
            self._db.execute("UPDATE causes SET duration = ? WHERE id = ?", (duration, number))

    def causes(self, last: int) -> list[RecordedCause]:
        """Return the newest `last` causes, the newest first."""
        with self._errors_reported():
            rows = self._db.execute(
                "SELECT id, simulated, began, duration, effect, sentence, chain, x, y, "
                "map IS NOT NULL, camera IS NOT NULL FROM causes ORDER BY id DESC LIMIT ?",
                (last,),
            ).fetchall()
        return [_recorded(*row) for row in rows]

    def picture(self, number: int, kind: Picture) -> bytes | None:
        """Return a picture of a cause, None if there is none."""
        with self._errors_reported():
            row = self._db.execute(f"SELECT {kind} FROM causes WHERE id = ?", (number,)).fetchone()
        return row[0] if row else None


def read_causes(path: Path, last: int) -> list[RecordedCause]:
    """Return the newest causes of a history, the newest first. Raises StorageError."""
    with closing(CauseRecords(path)) as records:
        return records.causes(last)


def _recorded(
    number: int,
    simulated: int,
    began: str,
    duration: float | None,
    effect: str,
    sentence: str,
    chain: str,
    x: float | None,
    y: float | None,
    has_map: int,
    has_camera: int,
) -> RecordedCause:
    kinds: tuple[tuple[Picture, int], ...] = (("map", has_map), ("camera", has_camera))
    return RecordedCause(
        number=number,
        simulated=bool(simulated),
        began=began,
        duration=duration,
        effect=effect,
        sentence=sentence,
        chain=tuple(json.loads(chain)),
        x=x,
        y=y,
        pictures=tuple(kind for kind, there in kinds if there),
    )
