"""Reading of untrusted MCAP files with the mcap library, with limits for what a small file can unpack to.

The library takes the sizes in a file as they are: it reserves as much memory as a record claims to have, and unpacks
a chunk to whatever is in it. Here both are limited before anything is read or unpacked.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from typing import Any, BinaryIO, TypeVar

import lz4.frame
import zstandard
from mcap import stream_reader
from mcap.data_stream import ReadDataStream
from mcap.exceptions import (
    EndOfFile,
    InvalidMagic,
    McapError,
    RecordLengthLimitExceeded,
    UnsupportedCompressionError,
)
from mcap.reader import McapReader, make_reader
from mcap.records import Chunk, McapRecord

from chefbot.errors import ChefbotError

T = TypeVar("T")
MAX_CHUNK_BYTES = 100_000_000
"""Bytes that a chunk may unpack to; recorders write chunks of 1 to 4 MB, or of one large message."""
MAX_CHUNK_RECORDS = 300_000
MAX_RATIO, FREE_BYTES = 100, 50_000_000
"""All messages of a file may have this many times its size, and some bytes more."""
READ_ERRORS = (
    McapError, zstandard.ZstdError, struct.error, ValueError, EOFError, KeyError, IndexError, MemoryError,
    OverflowError,
    RuntimeError,
)  # fmt: skip
"""Exceptions that the mcap library and its decompressors raise for a file that is truncated or corrupt."""
_SENTENCES: tuple[tuple[type[Exception] | tuple[type[Exception], ...], str], ...] = (
    (InvalidMagic, "it does not begin or end as an MCAP file does"),
    ((EndOfFile, EOFError, struct.error, RecordLengthLimitExceeded), "it ends in the middle of a record"),
    ((zstandard.ZstdError, RuntimeError), "it has a chunk that cannot be unpacked"),
    (UnsupportedCompressionError, "it has a chunk with an unknown compression"),
    (stream_reader.CRCValidationError, "it has a wrong checksum"),
    (MemoryError, "it has a record that claims to be larger than the memory"),
    (UnicodeDecodeError, "it has a name that is not text"),
    ((KeyError, IndexError), "it names something that it does not contain"),
)


class McapLimitError(McapError, ChefbotError):
    """A file that would take too much memory; the message begins with 'it'."""


def reason(error: Exception) -> str:
    """Return in words why an MCAP file cannot be read, for one of READ_ERRORS."""
    if isinstance(error, McapLimitError):
        return str(error)
    return next((text for kinds, text in _SENTENCES if isinstance(error, kinds)), "it has a damaged record")


def mcap_reader(file: BinaryIO, *, validate_crcs: bool = False) -> McapReader:
    """Return the library's reader, which uses the index at the end of a file."""
    return make_reader(_BoundedFile(file), validate_crcs=validate_crcs)


def mcap_records(file: BinaryIO) -> Iterator[McapRecord]:
    """Iterate over the records from the beginning of a file, those within chunks too; without an index."""
    return stream_reader.StreamReader(_BoundedFile(file), record_size_limit=None).records


def limited(messages: Iterator[T], file: BinaryIO) -> Iterator[T]:
    """Yield messages of a file, whose last element or self has `data`, until they are too many for its size."""
    limit = MAX_RATIO * _size_of(file) + FREE_BYTES
    size = 0
    for item in messages:
        message: Any = item[-1] if isinstance(item, tuple) else item
        size += len(message.data) + _HEAD.size
        if size > limit:
            raise McapLimitError(f"it unpacks to more than {limit} bytes, {MAX_RATIO} times its size")
        yield item


class _BoundedFile:
    """A file of which no more is requested than it has: Python reserves memory for what is requested."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = _size_of(file)

    def __getattr__(self, name: str) -> Any:
        """Return another method of the file, such as `seek`."""
        return getattr(self._file, name)

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a position. Raises EndOfFile for one outside the file, which a damaged index may name."""
        position = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._file.tell(), io.SEEK_END: self._size}[whence]
        if not 0 <= position <= self._size:
            raise EndOfFile
        return self._file.seek(position)

    def read(self, size: int = -1) -> bytes:
        """Read at most `size` bytes."""
        remaining = max(0, self._size - self._file.tell())
        return self._file.read(remaining if size < 0 else min(size, remaining))


def _size_of(file: BinaryIO) -> int:
    at = file.tell()
    size = file.seek(0, io.SEEK_END)
    file.seek(at)
    return size


_HEAD = struct.Struct("<BQ")
"""Begin of a record: kind and length (MCAP specification)."""


def _chunk_stream(chunk: Chunk, validate_crc: bool = False) -> tuple[ReadDataStream, int]:
    """Return the unpacked records of a chunk and their size, as the library's function of the same signature."""
    data = _unpacked(chunk)
    if validate_crc and chunk.uncompressed_crc not in (0, crc := zlib.crc32(data)):
        raise stream_reader.CRCValidationError(expected=chunk.uncompressed_crc, actual=crc, record=chunk)
    _check_number(data)
    return ReadDataStream(io.BytesIO(data)), len(data)


def _unpacked(chunk: Chunk) -> bytes:
    size = chunk.uncompressed_size
    if chunk.compression == "zstd":
        size = max(size, zstandard.frame_content_size(chunk.data))
    if size > MAX_CHUNK_BYTES:
        raise McapLimitError(
            f"it has a chunk that claims to unpack to {size} bytes; {MAX_CHUNK_BYTES} is the maximum"
        )
    if chunk.compression == "zstd":
        return zstandard.decompress(chunk.data, size)
    if chunk.compression == "lz4":
        unpacker = lz4.frame.LZ4FrameDecompressor()
        data: bytes = unpacker.decompress(chunk.data, max_length=size)
        if not unpacker.eof and unpacker.decompress(b"", max_length=1):
            raise McapLimitError(f"it has a chunk that unpacks to more than the {size} bytes that it claims")
        return data
    if chunk.compression:
        raise UnsupportedCompressionError(chunk.compression[:20])
    return chunk.data


def _check_number(data: bytes) -> None:
    """Raise McapError for a chunk of very many, tiny records: each becomes an object that is many times larger."""
    at = number = 0
    while at + _HEAD.size <= len(data):
        kind, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size + length
        number += 1
        if number > MAX_CHUNK_RECORDS or kind == 0:
            raise McapLimitError(f"it has a chunk of more than {MAX_CHUNK_RECORDS} records, or one of kind 0")


# The library has no limit for a chunk, neither as argument nor in a method; its readers look this function up here.
stream_reader.get_chunk_data_stream = _chunk_stream
