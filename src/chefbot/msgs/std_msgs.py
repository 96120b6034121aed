"""std_msgs: the message header and primitive values."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl import message
from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Message


class Header(Message, frozen=True, eq=False):
    """The time and the coordinate frame of a message."""

    stamp: Time = Time()
    frame_id: message.String = ""

    @staticmethod
    def of(ns: int, frame_id: str) -> Header:
        """Create a header from integer nanoseconds and a frame."""
        return Header(Time.of(ns), frame_id)


class Empty(Message, frozen=True, eq=False):
    """A message without content; ROS serializes an empty struct as one byte."""

    structure_needs_at_least_one_member: message.Uint8 = 0


class Bool(Message, frozen=True, eq=False):
    """A message with one boolean."""

    data: message.Bool = False


class String(Message, frozen=True, eq=False):
    """A message with one string."""

    MAX_LENGTHS = per_field(data=10_000_000)

    data: message.String = ""


class Float64(Message, frozen=True, eq=False):
    """A message with one double-precision number."""

    data: message.Float64 = 0.0


class Float32(Message, frozen=True, eq=False):
    """A message with one single-precision number."""

    data: message.Float32 = 0.0


class Int32(Message, frozen=True, eq=False):
    """A message with one 32-bit integer."""

    data: message.Int32 = 0


class ColorRGBA(Message, frozen=True, eq=False):
    """A color with alpha, all components from 0 to 1."""

    r: message.Float32 = 0.0
    g: message.Float32 = 0.0
    b: message.Float32 = 0.0
    a: message.Float32 = 0.0
