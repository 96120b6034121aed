"""Writer for MCAP files with the ros2 profile, shared by recordings of runs and bags."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, TypeVar

from chefbot import __version__
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.disk_reservation import DiskReservation
from chefbot.storage.mcap_file import McapFile

T = TypeVar("T")
RECORD, MESSAGE, CHANNEL_INDEX = 64, 64, 32
"""Upper bounds of MCAP's overhead, bytes: per record; per message and index; per channel in that index."""
CHUNK, CHUNK_CHANNEL = 1024, 10
"""Upper bounds of the overhead of a chunk and its index, and of each channel in that index, bytes."""
END = 1024
"""Upper bound for footer, statistics and offsets, bytes."""
MAX_GROWTH = 1.01
"""Upper bound of the growth of incompressible data (zstd's bound: 1/256 and some bytes)."""


class McapWriter:
    """Writes messages, as CDR bytes, to an MCAP file; StorageError, once, if the disk is full or gone.

    It reserves space for the end of the file before it accepts a message: a file that ends because the disk
    is full is complete, with all messages accepted before. `last_record` returns a metadata record to be
    written last.
    """

    def __init__(
        self, path: Path, last_record: Callable[[], tuple[str, dict[str, str]]] | None = None
    ) -> None:
        self.path = path
        self._last_record = last_record
        self._schemas: dict[tuple[str, bytes], int] = {}
        self._channels = 0
        self._file = _open(path)
        self._reservation = DiskReservation(self._file.fileno())
        self._chunk_bytes, self._end_bytes = 0, END
        self._stream = _CountingStream(self._file)
        self._writer = McapFile(self._stream, profile="ros2", library=f"chefbot {__version__}")

    @property
    def closed(self) -> bool:
        """Whether the file is closed and accepts no more messages."""
        return self._file.closed

    def channel(self, topic: str, kind: str, definition: str, metadata: dict[str, str]) -> int:
        """Register a channel for messages of type `kind`; an unknown definition is the empty string."""
        schema = self._schema(kind, definition.encode())
        size = RECORD + len(topic.encode()) + _size(metadata)
        self._end_bytes += size + CHUNK_CHANNEL
        self._channels += 1
        return self._write(size, lambda: self._writer.add_channel(topic, schema, metadata))

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """Write a metadata record: a named table of strings."""
        self._end_bytes += RECORD + len(name.encode())
        self._write_reserved(
            RECORD + _size({name: "", **values}), lambda: self._writer.add_metadata(name, values)
        )

    def reserve(self, size: int) -> None:
        """Reserve `size` more bytes for what `last_record` returns."""
        self._end_bytes += size

    def add(self, channel: int, data: bytes, log_ns: int, publish_ns: int, sequence: int) -> None:
        """Write one message to a channel."""
        write = self._writer.add_message
        self._write(MESSAGE + len(data), lambda: write(channel, log_ns, data, publish_ns, sequence))

    def flush(self) -> None:
        """Write all messages added so far to the file, so that they survive the death of this process."""
        self._write(0, self._writer.flush)

    def close(self) -> None:
        """Write the index; without it readers must scan the file."""
        try:
            self._finish()
        except OSError as error:
            raise StorageError(f"recording {self.path} could not be finished: {error.strerror}") from None

    def _schema(self, kind: str, definition: bytes) -> int:
        key = kind, definition
        if key not in self._schemas:
            size = RECORD + len(kind.encode()) + len(definition)
            self._end_bytes += size
            self._schemas[key] = self._write(size, lambda: self._writer.add_schema(kind, definition))
        return self._schemas[key]

    def _write(self, size: int, write: Callable[[], T]) -> T:
        """Write to the current chunk, which goes to the file when it is large enough or on `flush`."""
        start = self._stream.position
        result = self._write_reserved(size, write)
        self._chunk_bytes += size
        if self._stream.position > start:
            self._chunk_bytes = 0
            self._end_bytes += CHUNK + CHUNK_CHANNEL * self._channels
        return result

    def _write_reserved(self, size: int, write: Callable[[], T]) -> T:
        """Write if there is space for it and for the end of the file.

        A full disk closes the file properly.
        """
        # worst case: this write completes a chunk of incompressible data, and the file then has to be closed
        chunk_bytes = (
            (self._chunk_bytes + size) * MAX_GROWTH + CHUNK + (CHUNK_CHANNEL + CHANNEL_INDEX) * self._channels
        )
        try:
            self._reservation.reserve(self._stream.position + int(chunk_bytes) + self._end_bytes)
        except OSError as disk_full:
            self.close()
            raise self._stop_error(disk_full) from None
        try:
            return write()
        except OSError as error:
            with suppress(OSError):  # the first error is the one to report
                self._file.close()
            raise self._stop_error(error) from None

    def _stop_error(self, error: OSError) -> StorageError:
        return StorageError(
            f"recording {self.path} stopped: {error.strerror}; free space or record elsewhere"
        )

    def _finish(self) -> None:
        if self._file.closed:
            return
        try:
            if self._last_record is not None:
                self._writer.add_metadata(*self._last_record())
            self._writer.finish()
            self._file.flush()
            self._reservation.release()
        finally:
            self._file.close()


class _CountingStream:
    """A stream that counts its position without system calls."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.position = 0

    def write(self, data: bytes) -> int:
        """Write all the data and count it."""
        self.position += len(data)
        return self._file.write(data)

    def tell(self) -> int:
        """Return the number of bytes written so far."""
        return self.position

    def flush(self) -> None:
        """Flush the underlying file to the operating system."""
        self._file.flush()


def _size(texts: dict[str, str]) -> int:
    return sum(8 + len(key.encode()) + len(value.encode()) for key, value in texts.items())


def _open(path: Path) -> BinaryIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("wb")
    except OSError as error:
        raise StorageError(f"cannot record to {path}: {error.strerror}") from None
