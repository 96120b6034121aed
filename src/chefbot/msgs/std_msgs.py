"""std_msgs: headers and plain values."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl import message
from chefbot.msgs.idl.message import Message


class Header(Message, frozen=True, eq=False):
    """When and in which frame."""

    stamp: Time = Time()
    frame_id: message.String = ""

    @staticmethod
    def of(ns: int, frame_id: str) -> Header:
        """From integer nanoseconds and a frame."""
        return Header(Time.of(ns), frame_id)


class Empty(Message, frozen=True, eq=False):
    """Nothing but that it happened; ROS gives an empty struct one byte."""

    structure_needs_at_least_one_member: message.Uint8 = 0


class Bool(Message, frozen=True, eq=False):
    """Yes or no."""

    data: message.Bool = False


class String(Message, frozen=True, eq=False):
    """A text."""

    data: message.String = ""


class Float64(Message, frozen=True, eq=False):
    """A number."""

    data: message.Float64 = 0.0


class Float32(Message, frozen=True, eq=False):
    """A number of single precision."""

    data: message.Float32 = 0.0


class Int32(Message, frozen=True, eq=False):
    """A whole number."""

    data: message.Int32 = 0


class ColorRGBA(Message, frozen=True, eq=False):
    """A colour, shares of one."""

    r: message.Float32 = 0.0
    g: message.Float32 = 0.0
    b: message.Float32 = 0.0
    a: message.Float32 = 0.0
