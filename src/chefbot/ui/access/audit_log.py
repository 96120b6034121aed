"""The audit log: who did what at the web UI and when, as JSON lines in the robot's state folder.

The log is bounded in size by rotation and in rate by kind, so that no flood fills the disk or hides an emergency
stop. A thread writes; each line is one append, so that a crash leaves complete lines.
"""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path
from typing import Any

import msgspec

from chefbot.devices.state_files import state_folder

MAX_BYTES = 1_000_000
"""Size at which a file is rotated, bytes."""
MAX_FILES = 5
"""Number of files: the current one, and older ones with the endings `.1` (the newest) to `.4`."""
MAX_DETAILS = 500
"""Maximum length of an entry's details as JSON, characters; longer ones are cut."""
QUEUE_LENGTH = 1000
"""Maximum number of entries that wait for the disk."""


class Kind(Enum):
    """Kinds of entries; each has a rate limit of its own: entries per second, and how many at once."""

    SAFETY = (20.0, 100.0)
    """Emergency stop: press, withdrawal, release."""
    COMMAND = (10.0, 200.0)
    """Other commands, changed parameters, saved maps."""
    CONNECTION = (2.0, 100.0)
    """Clients that connect and disconnect."""


class AuditEntry(msgspec.Struct, frozen=True, omit_defaults=True):
    """One line of the log."""

    time: datetime
    """UTC."""
    name: str = ""
    role: str = ""
    address: str = ""
    action: str = ""
    details: dict[str, Any] = {}
    refused: str = ""
    """Why the command was refused; empty if it was accepted."""
    dropped: int = 0
    """Number of entries of the same kind before this one that exceeded the rate limit."""


def audit_path(robot: str) -> Path:
    """Return the current file of a robot's audit log."""
    return state_folder() / "audit" / f"{robot}.jsonl"


def recorded_robots() -> list[str]:
    """Return the names of the robots that have an audit log on this computer."""
    return sorted(path.stem for path in audit_path("").parent.glob("*.jsonl") if path.stem)


def read_entries(path: Path) -> Iterator[AuditEntry]:
    """Yield all entries, the oldest first; lines that a crash has cut are skipped."""
    for file in [*(_rotated(path, number) for number in range(MAX_FILES - 1, 0, -1)), path]:
        try:
            lines = file.read_bytes().splitlines()
        except FileNotFoundError:
            continue
        for line in lines:
            try:
                yield msgspec.json.decode(line, type=AuditEntry)
            except msgspec.MsgspecError:
                continue


class AuditLog:
    """Appends entries to `path`, and reports when that begins to fail and when it works again.

    `on_error` is called in a thread with a sentence, and `on_recovery` with the same sentence afterwards.
    """

    def __init__(
        self, path: Path, on_error: Callable[[str], None], on_recovery: Callable[[str], None]
    ) -> None:
        self.path = path
        self._on_error, self._on_recovery = on_error, on_recovery
        self._buckets = {kind: _Bucket(*kind.value) for kind in Kind}
        self._lock = threading.Lock()
        self._queue: queue.Queue[AuditEntry | None] = queue.Queue(QUEUE_LENGTH)
        self._problem = ""
        self._thread = threading.Thread(target=self._write_forever, name="audit log", daemon=True)
        self._thread.start()

    def record(
        self, kind: Kind, who: tuple[str, str, str], action: str, details: dict[str, Any], refusal: str = ""
    ) -> None:
        """Add an entry; `who`: name, role and address. Thread-safe, never blocks."""
        with self._lock:
            dropped = self._buckets[kind].take(time.monotonic())
        if dropped is None:
            return
        entry = AuditEntry(datetime.now(UTC), *who, action, _cut(details), refusal[:MAX_DETAILS], dropped)
        try:
            self._queue.put_nowait(entry)
        except queue.Full:
            with self._lock:
                self._buckets[kind].dropped += dropped + 1

    def close(self) -> None:
        """Write what waits, and end the thread."""
        self._queue.put(None)
        self._thread.join()

    def _write_forever(self) -> None:
        while (entry := self._queue.get()) is not None:
            try:
                append_line(self.path, msgspec.json.encode(entry))
                self._note_problem("")
            except OSError as error:
                self._note_problem(f"the audit log {self.path} cannot be written: {error.strerror or error}")

    def _note_problem(self, problem: str) -> None:
        """Report that writing fails for another reason than before, or works again."""
        if problem == self._problem:
            return
        if self._problem:
            self._on_recovery(self._problem)
        if problem:
            self._on_error(problem)
        self._problem = problem


def append_line(path: Path, line: bytes) -> None:
    """Append a line in one write, and rotate the files when the current one is full.

    Several processes may append: a file lock makes rotation and write one step. Raises OSError if that fails.
    """
    import fcntl  # Unix only

    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    lock = os.open(path.with_name(f".{path.name}.lock"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _rotate_if_full(path)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        try:
            size = os.fstat(handle).st_size
            cut = size > 0 and os.pread(handle, 1, size - 1) != b"\n"  # by a crash
            data = (b"\n" if cut else b"") + line + b"\n"
            if os.write(handle, data) < len(data):  # the disk is full: leave no half of a line
                os.ftruncate(handle, size)
                raise OSError("the disk is full")
        finally:
            os.close(handle)
    finally:
        os.close(lock)


def _rotate_if_full(path: Path) -> None:
    if not path.exists() or path.stat().st_size < MAX_BYTES:
        return
    for number in range(MAX_FILES - 1, 0, -1):
        source = _rotated(path, number - 1) if number > 1 else path
        if source.exists():
            source.replace(_rotated(path, number))


def _rotated(path: Path, number: int) -> Path:
    return path.with_name(f"{path.name}.{number}")


def _cut(details: dict[str, Any]) -> dict[str, Any]:
    """Return the details, or their beginning as a text if they are too long."""
    text = msgspec.json.encode(details).decode()
    return details if len(text) <= MAX_DETAILS else {"cut": text[:MAX_DETAILS]}


class _Bucket:
    """A token bucket that counts what it drops."""

    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate, burst
        self._tokens, self._updated = burst, time.monotonic()
        self.dropped = 0

    def take(self, now: float) -> int | None:
        """Return how many were dropped before this one, or None if this one is dropped."""
        self._tokens = min(self._burst, self._tokens + (now - self._updated) * self._rate)
        self._updated = now
        if self._tokens < 1.0:
            self.dropped += 1
            return None
        self._tokens -= 1.0
        dropped, self.dropped = self.dropped, 0
        return dropped
