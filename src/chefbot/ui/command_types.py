"""Base of the operator's commands, and the types of their fields."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

Metre = Annotated[float, msgspec.Meta(ge=-10_000, le=10_000, description="map frame, metres")]
Angle = Annotated[float, msgspec.Meta(ge=-7, le=7, description="radians, counter-clockwise from the x axis")]
Share = Annotated[float, msgspec.Meta(ge=-1, le=1, description="part of the robot's own limit")]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=64, description="name of a place or door")]
Tables = Annotated[list[Name], msgspec.Meta(min_length=1, max_length=32)]
Rounds = Annotated[
    int, msgspec.Meta(ge=0, le=10_000, description="number of rounds; 0: until it is cancelled")
]
PersonNumber = Annotated[
    int, msgspec.Meta(ge=0, lt=2**32, description="the tracker's number of the person; 0: none")
]
When = Literal["", "now", "after", "instead"]
"""When to drive during a delivery round: the round pauses, is completed first, or ends. Empty without a
round."""
Id = Annotated[str, msgspec.Meta(max_length=64, description="of one press; the same when it is sent again")]
EditName = Annotated[str, msgspec.Meta(max_length=64, description="of a place or zone; empty: a new one")]
GraphName = Annotated[str, msgspec.Meta(max_length=256, description="of a topic, node or parameter")]
Here = Annotated[
    str, msgspec.Meta(max_length=64, description="place that the person saw; empty: wherever it is")
]


class OperatorCommand(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do"):
    """Base of all commands; match on the class."""
