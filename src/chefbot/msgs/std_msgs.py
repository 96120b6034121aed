"""std_msgs: headers and plain values."""

from __future__ import annotations

from chefbot.msgs import base
from chefbot.msgs.base import Message
from chefbot.msgs.builtin_interfaces import Time


class Header(Message, frozen=True, eq=False):
    """When and in which frame."""

    stamp: Time = Time()
    frame_id: base.String = ""

    @staticmethod
    def of(ns: int, frame_id: str) -> Header:
        """From integer nanoseconds and a frame."""
        return Header(Time.of(ns), frame_id)


class Empty(Message, frozen=True, eq=False):
    """Nothing but that it happened; ROS gives an empty struct one byte."""

    structure_needs_at_least_one_member: base.Uint8 = 0


class Bool(Message, frozen=True, eq=False):
    """Yes or no."""

    data: base.Bool = False


class String(Message, frozen=True, eq=False):
    """A text."""

    data: base.String = ""


class Float64(Message, frozen=True, eq=False):
    """A number."""

    data: base.Float64 = 0.0


class Float32(Message, frozen=True, eq=False):
    """A number of single precision."""

    data: base.Float32 = 0.0


class Int32(Message, frozen=True, eq=False):
    """A whole number."""

    data: base.Int32 = 0


class ColorRGBA(Message, frozen=True, eq=False):
    """A colour, shares of one."""

    r: base.Float32 = 0.0
    g: base.Float32 = 0.0
    b: base.Float32 = 0.0
    a: base.Float32 = 0.0
