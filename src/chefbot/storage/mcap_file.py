"""MCAP files in chunks with indexes, byte for byte as `mcap.writer.Writer` writes them by default.

The library builds ten objects and calls for each message, 5 us on an idle machine; a record is one `pack` here.
All other records are the library's.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from typing import Protocol

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
CHUNK_SIZE = 1024 * 1024
"""Bytes after which a chunk is compressed and written."""
_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_FIELDS = 22
"""Bytes of a message record's fields before its data."""


class ByteStream(Protocol):
    """A stream that counts its position."""

    def write(self, data: bytes) -> int:
        """Write all data and return their number of bytes."""

    def tell(self) -> int:
        """Return the number of bytes written so far."""

    def flush(self) -> None:
        """Write buffered data to the underlying file."""


class McapFile:
    """An MCAP file that is written from its begin to its end; `finish` writes the summary."""

    def __init__(self, stream: ByteStream, profile: str, library: str) -> None:
        self._stream = stream
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._start_chunk()
        stream.write(MAGIC)
        self._write(Header(profile, library))

    def add_schema(self, name: str, definition: bytes) -> int:
        """Add a definition of a ROS 2 type and return its number."""
        schema = Schema(id=len(self._schemas) + 1, data=definition, encoding="ros2msg", name=name)
        self._schemas.append(schema)
        self._append(_bytes_of([schema]))
        return schema.id

    def add_channel(self, topic: str, schema: int, metadata: dict[str, str]) -> int:
        """Add a channel of CDR messages and return its number."""
        number = len(self._channels) + 1
        channel = Channel(id=number, topic=topic, message_encoding="cdr", schema_id=schema, metadata=metadata)
        self._channels.append(channel)
        self._append(_bytes_of([channel]))
        return number

    def add_message(self, channel: int, log_ns: int, data: bytes, publish_ns: int, sequence: int) -> None:
        """Add a message to the current chunk."""
        self._index.setdefault(channel, []).extend((log_ns, self._size))
        self._counts[channel] = self._counts.get(channel, 0) + 1
        self._times.append(log_ns)
        length = _MESSAGE_FIELDS + len(data)
        fields = _MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence, log_ns, publish_ns)
        self._append(fields + data)

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Write a named table of strings, before the messages of the current chunk."""
        offset = self._stream.tell()
        length = self._write(Metadata(name=name, metadata=values))
        self._metadata.append(MetadataIndex(offset=offset, length=length, name=name))

    def flush(self) -> None:
        """Write the current chunk and flush the stream."""
        self._write_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the current chunk and the summary."""
        self._write_chunk()
        self._write(DataEnd(0))
        start = self._stream.tell()
        summary, offsets = self._summary(start)
        crc = zlib.crc32(summary)
        fields = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets)
        self._stream.write(summary)
        self._write(Footer(start, offsets, zlib.crc32(fields, crc)))
        self._stream.write(MAGIC)

    def _start_chunk(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self._times: list[int] = []
        self._index: dict[int, list[int]] = {}
        """Log time and offset in the chunk of each message by channel."""

    def _append(self, record: bytes) -> None:
        self._parts.append(record)
        self._size += len(record)
        if self._size > CHUNK_SIZE:
            self._write_chunk()

    def _write_chunk(self) -> None:
        if not self._times:
            return
        records = b"".join(self._parts)
        times = (min(self._times), max(self._times))
        data = zstandard.compress(records)
        chunk = Chunk(
            compression="zstd",
            data=data,
            message_start_time=times[0],
            message_end_time=times[1],
            uncompressed_crc=zlib.crc32(records),
            uncompressed_size=len(records),
        )
        start = self._stream.tell()
        length = self._write(chunk)
        offsets = {number: self._write_index(number, index) for number, index in self._index.items()}
        index_length = self._stream.tell() - start - length
        self._chunks.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression="zstd",
                compressed_size=len(data),
                message_start_time=times[0],
                message_end_time=times[1],
                message_index_length=index_length,
                message_index_offsets=offsets,
                uncompressed_size=len(records),
            )
        )
        self._start_chunk()

    def _write_index(self, channel: int, index: list[int]) -> int:
        """Write the index of one channel's messages in a chunk and return its offset in the file."""
        offset, size = self._stream.tell(), 8 * len(index)
        layout = f"<BQHI{len(index)}Q"
        self._stream.write(struct.pack(layout, Opcode.MESSAGE_INDEX, 6 + size, channel, size, *index))
        return offset

    def _summary(self, start: int) -> tuple[bytes, int]:
        """Return the records of the summary, which begins at `start`, and where its offsets begin."""
        groups: list[tuple[Opcode, Iterable[McapRecord]]] = [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, []),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        summary, offsets = b"", []
        for opcode, records in groups:
            group = _bytes_of(records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        return summary + _bytes_of(offsets), start + len(summary)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            metadata_count=len(self._metadata),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            schema_count=len(self._schemas),
        )

    def _write(self, record: McapRecord) -> int:
        """Write a record to the stream and return its length."""
        data = _bytes_of([record])
        self._stream.write(data)
        return len(data)


def _bytes_of(records: Iterable[McapRecord]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()
