"""The 33-byte attachment of every sample, request and reply: sequence number, time stamp and GID."""

from __future__ import annotations

import struct
from typing import NamedTuple

from chefbot.ros2.rmw.errors import RmwError

_FORMAT = struct.Struct("<qqB16s")
_FIELDS = struct.Struct("<qqx16s")
_GID_SIZE_OFFSET = 16
SIZE = _FORMAT.size
GID_SIZE = 16


class Attachment(NamedTuple):
    """Metadata of a sample, request or reply.

    On a topic it describes the publisher; on a service the client, whose sequence number and GID the reply
    repeats.
    """

    sequence: int
    """Sequence number, starting at 1."""
    stamp_ns: int
    """System clock of the sender, ns since the epoch."""
    gid: bytes
    """GID of the publisher or client, 16 bytes."""

    def pack(self) -> bytes:
        """Serialize the attachment to its 33 bytes."""
        return pack(*self)


def pack(sequence: int, stamp_ns: int, gid: bytes) -> bytes:
    """Serialize an attachment as Zenoh's serializer does (int64, int64, bytes)."""
    return _FORMAT.pack(sequence, stamp_ns, GID_SIZE, gid)


def parse(data: bytes | None) -> Attachment:
    """Parse an attachment; raises RmwError under the same conditions as `checked`."""
    return Attachment._make(_FIELDS.unpack(checked(data)))


def checked(data: bytes | None) -> bytes:
    """Return the bytes of an attachment after checking their form.

    Raises RmwError when they are missing or of another form, e.g. that of rmw_zenoh on Jazzy before 0.2.4.
    """
    if data is None:
        raise RmwError("no attachment")
    if len(data) != SIZE:
        raise RmwError(f"an attachment of {len(data)} bytes instead of {SIZE}")
    if data[_GID_SIZE_OFFSET] != GID_SIZE:
        raise RmwError(f"an attachment whose gid has {data[_GID_SIZE_OFFSET]} bytes")
    return data
