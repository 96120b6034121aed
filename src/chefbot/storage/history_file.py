"""The SQLite file with the history of a robot: its delivery rounds, and why it slowed down, stopped or failed.

A write-ahead log makes each change atomic, so a crash at any moment loses at most the change that was being made.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

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
    """
    CREATE TABLE causes (
        id INTEGER PRIMARY KEY, simulated INTEGER NOT NULL, began TEXT NOT NULL, duration REAL, effect TEXT NOT NULL,
        sentence TEXT NOT NULL, chain TEXT NOT NULL, x REAL, y REAL, map BLOB, camera BLOB
    ) STRICT;
    """,
    "ALTER TABLE stops ADD COLUMN label TEXT NOT NULL DEFAULT ''",
)
"""One script a version of the file, which `PRAGMA user_version` counts; opening a file brings it to the newest."""
BUSY_TIMEOUT = 2.0
"""Time to wait for another process that is writing, s."""


class HistoryFile:
    """Base class of what reads and writes tables of the file at `path`, which is created if it does not exist.

    Raises StorageError, here and in every method, if the file cannot be used.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._time = path, ""
        make_folder(path.parent)
        with self._errors_reported():
            path.touch(mode=0o600)  # names and pictures of persons: for the owner only
            self._db = sqlite3.connect(path, timeout=BUSY_TIMEOUT, isolation_level=None)
            self._migrate()

    def close(self) -> None:
        """Close the file and end its use."""
        self._db.close()

    def _migrate(self) -> None:
        """Bring the file to the newest version; StorageError for a newer one."""
        self._db.execute("PRAGMA journal_mode = WAL")
        self._db.execute("PRAGMA synchronous = NORMAL")
        if self._version() == len(MIGRATIONS):
            return  # opened for reading, it stays as it is
        with self._transaction():  # so that of two processes one migrates
            version = self._version()
            if version > len(MIGRATIONS):
                raise StorageError(f"{self.path} is of a newer version of chefbot; it is left alone")
            for script in MIGRATIONS[version:]:
                for statement in script.split(";"):
                    self._db.execute(statement)
            self._db.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")

    def _version(self) -> int:
        (version,) = self._db.execute("PRAGMA user_version").fetchone()
        return int(version)

    @contextmanager
    def changes_of(self, time: str) -> Iterator[None]:
        """Make all changes at once or none of them, with the time (UTC, ISO 8601) at which they happened."""
        with self._transaction():
            self._time = time
            try:
                yield
            finally:
                self._time = ""

    def _now(self) -> str:
        """Return the time of a change, UTC in ISO 8601."""
        return self._time or utc_now()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        if self._db.in_transaction:
            yield  # part of another one
            return
        with self._errors_reported():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._db.execute("COMMIT")
            except BaseException:
                if self._db.in_transaction:  # a full disk has ended it already
                    self._db.execute("ROLLBACK")
                raise

    @contextmanager
    def _errors_reported(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError) as error:
            raise StorageError(f"the history {self.path} cannot be used: {error}") from None


def utc_now() -> str:
    """Return the time in UTC as ISO 8601, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")
