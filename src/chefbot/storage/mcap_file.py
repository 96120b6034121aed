"""One MCAP file being written, with the ros2 profile: what recordings of runs and bags have in common."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, TypeVar

from mcap.writer import CompressionType, Writer

from chefbot import __version__
from chefbot.errors import UserError
from chefbot.storage.disk_reservation import Room

T = TypeVar("T")
RECORD, MESSAGE, CHANNEL_INDEX = 64, 64, 32
"""Bytes of which MCAP needs less around a record; for a message and its index; for a channel in such an index."""
CHUNK, CHUNK_CHANNEL = 1024, 10
"""The same for a chunk and its index; there, for each channel."""
END = 1024
"""For footer, statistics and offsets."""
WORST = 1.01
"""What does not compress grows by less (zstd's bound: 1/256 and some bytes)."""


class McapFile:
    """Takes CDR bytes. UserError, once, when the disk is full or gone.

    It takes room for its own end before it takes a message: a file that ends because the disk is full is whole, with
    all messages that were taken before. `last_record` gives a table of texts to be written at the very end.
    """

    def __init__(
        self, path: Path, last_record: Callable[[], tuple[str, dict[str, str]]] | None = None
    ) -> None:
        self.path = path
        self._last_record = last_record
        self._schemas: dict[tuple[str, bytes], int] = {}
        self._channels = 0
        self._file = _open(path)
        self._room = Room(self._file.fileno())
        self._pending, self._end = 0, END
        self._counted = _Counted(self._file)
        self._writer = Writer(self._counted, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=f"chefbot {__version__}")

    @property
    def closed(self) -> bool:
        """Whether it takes no more."""
        return self._file.closed

    def channel(self, topic: str, kind: str, definition: str, metadata: dict[str, str]) -> int:
        """A new channel of messages of type `kind`; an unknown definition is the empty text."""
        schema = self._schema(kind, definition.encode())
        size = RECORD + len(topic.encode()) + _size(metadata)
        self._end += size + CHUNK_CHANNEL
        self._channels += 1
        return self._write(size, lambda: self._writer.register_channel(topic, "cdr", schema, metadata))

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """A named table of texts."""
        self._end += RECORD + len(name.encode())
        self._guarded(RECORD + _size({name: "", **values}), lambda: self._writer.add_metadata(name, values))

    def reserve(self, size: int) -> None:
        """So much more that `last_record` may take."""
        self._end += size

    def add(self, channel: int, data: bytes, log_ns: int, publish_ns: int, sequence: int) -> None:
        """One message."""
        write = self._writer.add_message
        self._write(MESSAGE + len(data), lambda: write(channel, log_ns, data, publish_ns, sequence))

    def flush(self) -> None:
        """What was added so far can be read from now on, even if this process is killed."""
        self._write(0, self._writer.flush)

    def close(self) -> None:
        """Write the index; without it readers must scan the file."""
        try:
            self._finish()
        except OSError as error:
            raise UserError(f"recording {self.path} could not be finished: {error.strerror}") from None

    def _schema(self, kind: str, definition: bytes) -> int:
        key = kind, definition
        if key not in self._schemas:
            size = RECORD + len(kind.encode()) + len(definition)
            self._end += size
            register = self._writer.register_schema
            self._schemas[key] = self._write(size, lambda: register(kind, "ros2msg", definition))
        return self._schemas[key]

    def _write(self, size: int, write: Callable[[], T]) -> T:
        """Into the chunk in hand; it goes to the disk when it is large enough, or when it is asked to."""
        begun = self._counted.position
        done = self._guarded(size, write)
        self._pending += size
        if self._counted.position > begun:
            self._pending = 0
            self._end += CHUNK + CHUNK_CHANNEL * self._channels
        return done

    def _guarded(self, size: int, write: Callable[[], T]) -> T:
        """Done where there is room for it and for the end; a full disk ends the file, in order."""
        chunk = (self._pending + size) * WORST + CHUNK + (CHUNK_CHANNEL + CHANNEL_INDEX) * self._channels
        try:
            self._room.take(self._counted.position + int(chunk) + self._end)
        except OSError as full:
            self.close()
            raise self._stopped(full) from None
        try:
            return write()
        except OSError as broken:
            with suppress(OSError):  # what is told is why it broke
                self._file.close()
            raise self._stopped(broken) from None

    def _stopped(self, error: OSError) -> UserError:
        return UserError(f"recording {self.path} stopped: {error.strerror}; free space or record elsewhere")

    def _finish(self) -> None:
        if self._file.closed:
            return
        try:
            if self._last_record is not None:
                self._writer.add_metadata(*self._last_record())
            self._writer.finish()
            self._file.flush()
            self._room.give_back()
        finally:
            self._file.close()


class _Counted:
    """A stream that knows where it is without asking the system."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.position = 0

    def write(self, data: bytes) -> int:
        """All of it."""
        self.position += len(data)
        return self._file.write(data)

    def tell(self) -> int:
        """Bytes written so far."""
        return self.position

    def flush(self) -> None:
        """To the system."""
        self._file.flush()


def _size(texts: dict[str, str]) -> int:
    return sum(8 + len(key.encode()) + len(value.encode()) for key, value in texts.items())


def _open(path: Path) -> BinaryIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("wb")
    except OSError as error:
        raise UserError(f"cannot record to {path}: {error.strerror}") from None
