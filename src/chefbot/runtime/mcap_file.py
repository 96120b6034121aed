"""One MCAP file being written, with the ros2 profile: what recordings of runs and bags have in common."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, TypeVar

from mcap.writer import CompressionType, Writer

from chefbot import __version__
from chefbot.errors import UserError

T = TypeVar("T")


class McapFile:
    """Takes CDR bytes. UserError, once, when the disk is full or gone; what was written before can be read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._schemas: dict[tuple[str, bytes], int] = {}
        self._file = _open(path)
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=f"chefbot {__version__}")

    @property
    def closed(self) -> bool:
        """Whether it takes no more."""
        return self._file.closed

    def channel(self, topic: str, kind: str, definition: str, metadata: dict[str, str]) -> int:
        """A new channel of messages of type `kind`; an unknown definition is the empty text."""
        schema = self._schema(kind, definition.encode())
        return self._try(lambda: self._writer.register_channel(topic, "cdr", schema, metadata))

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """A named table of texts."""
        self._try(lambda: self._writer.add_metadata(name, values))

    def add(self, channel: int, data: bytes, log_ns: int, publish_ns: int, sequence: int) -> None:
        """One message."""
        self._try(lambda: self._writer.add_message(channel, log_ns, data, publish_ns, sequence))

    def flush(self) -> None:
        """What was added so far can be read from now on, even if this process is killed."""
        self._try(self._writer.flush)

    def close(self) -> None:
        """Write the index; without it readers must scan the file."""
        try:
            self._writer.finish()
            self._file.close()
        except OSError as error:
            raise UserError(f"recording {self.path} could not be finished: {error.strerror}") from None

    def _schema(self, kind: str, definition: bytes) -> int:
        key = kind, definition
        if key not in self._schemas:
            self._schemas[key] = self._try(lambda: self._writer.register_schema(kind, "ros2msg", definition))
        return self._schemas[key]

    def _try(self, write: Callable[[], T]) -> T:
        try:
            return write()
        except OSError as error:
            raise UserError(
                f"recording {self.path} stopped: {error.strerror}; free space or record elsewhere"
            ) from None


def _open(path: Path) -> BinaryIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("wb")
    except OSError as error:
        raise UserError(f"cannot record to {path}: {error.strerror}") from None
