"""The 33 bytes beside every sample, request and reply: which one, when, from whom."""

from __future__ import annotations

import struct
from typing import NamedTuple

from chefbot.ros2.rmw.errors import WireError

_FORM = struct.Struct("<qqB16s")
_FIELDS = struct.Struct("<qqx16s")
_GID_SIZE_AT = 16
SIZE = _FORM.size
GID_SIZE = 16


class Attachment(NamedTuple):
    """Of a topic: the publisher's; of a service: the client's, and a reply repeats number and gid."""

    sequence: int
    """Counts from 1."""
    stamp_ns: int
    """System clock of the sender."""
    gid: bytes
    """16 bytes."""

    def pack(self) -> bytes:
        """Its bytes."""
        return pack(*self)


def pack(sequence: int, stamp_ns: int, gid: bytes) -> bytes:
    """As Zenoh's serializer writes (int64, int64, bytes)."""
    return _FORM.pack(sequence, stamp_ns, GID_SIZE, gid)


def unpack(data: bytes | None) -> Attachment:
    """The attachment. WireError as `checked`."""
    return Attachment._make(_FIELDS.unpack(checked(data)))


def checked(data: bytes | None) -> bytes:
    """An attachment's bytes. WireError when there are none or of another form, e.g. that of Jazzy before 0.2.4."""
    if data is None:
        raise WireError("no attachment")
    if len(data) != SIZE:
        raise WireError(f"an attachment of {len(data)} bytes instead of {SIZE}")
    if data[_GID_SIZE_AT] != GID_SIZE:
        raise WireError(f"an attachment whose gid has {data[_GID_SIZE_AT]} bytes")
    return data
