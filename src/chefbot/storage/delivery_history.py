"""The history of a robot's delivery rounds in a SQLite file: who ordered what and when, and what became of it.

A write-ahead log makes each change atomic, so a crash at any moment loses at most the change that was being made.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from chefbot.storage.atomic_files import StorageError, make_folder

MIGRATIONS = (
    """
    CREATE TABLE rounds (
        id INTEGER PRIMARY KEY, order_id TEXT NOT NULL, ordered_by TEXT NOT NULL, simulated INTEGER NOT NULL,
        began TEXT NOT NULL, loaded TEXT, ended TEXT, outcome TEXT NOT NULL DEFAULT ''
    ) STRICT;
    CREATE TABLE stops (
        round INTEGER NOT NULL REFERENCES rounds (id), position INTEGER NOT NULL, place TEXT NOT NULL,
        outcome TEXT NOT NULL DEFAULT '', at TEXT, PRIMARY KEY (round, position)
    ) STRICT, WITHOUT ROWID;
    """,
)
"""One script a version of the file, which `PRAGMA user_version` counts; opening a file brings it to the newest."""
BUSY_TIMEOUT = 2.0
"""Time to wait for another process that is writing, s."""


class RecordedStop(msgspec.Struct, frozen=True):
    """One place of a round; times are UTC in ISO 8601."""

    place: str
    outcome: str
    """taken, or why the food was not; empty as long as it is open."""
    at: str | None


class RecordedRound(msgspec.Struct, frozen=True):
    """One round; times are UTC in ISO 8601."""

    ordered_by: str
    """Name or role of the person; empty for another program."""
    simulated: bool
    began: str
    loaded: str | None
    ended: str | None
    """None while it is under way, or if the robot was switched off meanwhile."""
    outcome: str
    """How it ended, in a sentence."""
    stops: tuple[RecordedStop, ...]


class DeliveryHistory:
    """Reads and writes the history in the file at `path`, which is created if it does not exist.

    Raises StorageError, here and in every method, if the file cannot be used.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        make_folder(path.parent)
        with self._errors_reported():
            path.touch(mode=0o600)  # names of persons: for the owner only
            self._db = sqlite3.connect(path, timeout=BUSY_TIMEOUT, isolation_level=None)
            self._migrate()

    def close(self) -> None:
        """Close the file and end its use."""
        self._db.close()

    def begin(self, order_id: str, ordered_by: str, places: Sequence[str], *, simulated: bool) -> int:
        """Add a round with these places and return its number."""
        with self._transaction():
            row = self._db.execute(
                "INSERT INTO rounds (order_id, ordered_by, simulated, began) VALUES (?, ?, ?, ?)",
                (order_id, ordered_by, simulated, _now()),
            )
            number = int(row.lastrowid or 0)
            self._db.executemany(
                "INSERT INTO stops (round, position, place) VALUES (?, ?, ?)",
                [(number, position, place) for position, place in enumerate(places)],
            )
        return number

    def open_round(self, order_id: str, places: Sequence[str]) -> int | None:
        """Return the number of the newest round if it has not ended and is this one, else None."""
        with self._errors_reported():
            newest = self._db.execute(
                "SELECT id, order_id, ended FROM rounds ORDER BY id DESC LIMIT 1"
            ).fetchone()
            if newest is None or newest[2] is not None or newest[1] != order_id:
                return None
            stops = self._db.execute("SELECT place FROM stops WHERE round = ? ORDER BY position", newest[:1])
            return int(newest[0]) if [place for (place,) in stops] == list(places) else None

    def note_loaded(self, number: int) -> None:
        """Note that the food of a round is on the tray; only the first time counts."""
        with self._transaction():
            self._db.execute("UPDATE rounds SET loaded = ? WHERE id = ? AND loaded IS NULL", (_now(), number))

    def note_stop(self, number: int, place: str, outcome: str) -> None:
        """Note the outcome of the first open stop of a round at this place."""
        with self._transaction():
            self._db.execute(
                "UPDATE stops SET outcome = ?, at = ? WHERE round = ? AND position = (SELECT min(position) "
                "FROM stops WHERE round = ? AND place = ? AND outcome = '')",
                (outcome, _now(), number, number, place),
            )

    def end(self, number: int, outcome: str) -> None:
        """Note the end of a round."""
        with self._transaction():
            self._db.execute(
                "UPDATE rounds SET ended = ?, outcome = ? WHERE id = ? AND ended IS NULL",
                (_now(), outcome, number),
            )

    def rounds(self, last: int) -> list[RecordedRound]:
        """Return the newest `last` rounds, the oldest of them first."""
        with self._errors_reported():
            rows = self._db.execute(
                "SELECT id, ordered_by, simulated, began, loaded, ended, outcome FROM rounds "
                "ORDER BY id DESC LIMIT ?",
                (last,),
            ).fetchall()
            return [self._round(row) for row in reversed(rows)]

    def _round(self, row: tuple[int, str, int, str, str | None, str | None, str]) -> RecordedRound:
        number, ordered_by, simulated, began, loaded, ended, outcome = row
        stops = self._db.execute(
            "SELECT place, outcome, at FROM stops WHERE round = ? ORDER BY position", (number,)
        )
        served = tuple(RecordedStop(*stop) for stop in stops)
        return RecordedRound(ordered_by, bool(simulated), began, loaded, ended, outcome, served)

    def _migrate(self) -> None:
        """Bring the file to the newest version; StorageError for a newer one."""
        self._db.execute("PRAGMA journal_mode = WAL")
        self._db.execute("PRAGMA synchronous = NORMAL")
        with self._transaction():  # so that of two processes one migrates
            (version,) = self._db.execute("PRAGMA user_version").fetchone()
            if version > len(MIGRATIONS):
                raise StorageError(f"{self.path} is of a newer version of chefbot; it is left alone")
            for script in MIGRATIONS[version:]:
                for statement in script.split(";"):
                    self._db.execute(statement)
            self._db.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._errors_reported():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
            except BaseException:
                self._db.execute("ROLLBACK")
                raise
            self._db.execute("COMMIT")

    @contextmanager
    def _errors_reported(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError) as error:
            raise StorageError(f"the history of deliveries {self.path} cannot be used: {error}") from None


def read_history(path: Path, last: int) -> list[RecordedRound]:
    """Return the newest rounds of a history, the oldest of them first. Raises StorageError."""
    with closing(DeliveryHistory(path)) as history:
        return history.rounds(last)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
