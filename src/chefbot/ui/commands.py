"""What an operator can tell the robot: a strict struct per command, as JSON `{"do": "goal", "x": 1, ...}`."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from chefbot.errors import UserError, nearest

MAX_TEXT = 64_000
"""Bytes of the longest message that a browser may send."""

Metre = Annotated[float, msgspec.Meta(ge=-10_000, le=10_000, description="map frame, metres")]
Angle = Annotated[float, msgspec.Meta(ge=-7, le=7, description="radians, counter-clockwise from the x axis")]
Share = Annotated[float, msgspec.Meta(ge=-1, le=1, description="part of the robot's own limit")]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=64, description="name of a place or door")]
Tables = Annotated[list[Name], msgspec.Meta(min_length=1, max_length=32)]
When = Literal["", "now", "after", "instead"]
"""A drive during a round: the round waits, goes first, or ends. Empty where there is no round."""
Id = Annotated[str, msgspec.Meta(max_length=64, description="of one press; the same when it is sent again")]
Here = Annotated[
    str, msgspec.Meta(max_length=64, description="place that the person saw; empty: wherever it is")
]


class Command(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do"):
    """The base of all commands; match on the class."""


class Goal(Command, frozen=True, forbid_unknown_fields=True, tag="goal"):
    """Drive to this pose."""

    x: Metre
    y: Metre
    yaw: Angle
    when: When = ""


class InitialPose(Command, frozen=True, forbid_unknown_fields=True, tag="initial_pose"):
    """The robot stands about here: start localization from it."""

    x: Metre
    y: Metre
    yaw: Angle


class Deliver(Command, frozen=True, forbid_unknown_fields=True, tag="deliver"):
    """Bring food to these tables, in this order."""

    tables: Tables


class Loaded(Command, frozen=True, forbid_unknown_fields=True, tag="loaded"):
    """The food is on the tray: leave the kitchen."""

    place: Here = ""


class Taken(Command, frozen=True, forbid_unknown_fields=True, tag="taken"):
    """The guest has taken the food: go on."""

    place: Here = ""


class NotTaken(Command, frozen=True, forbid_unknown_fields=True, tag="not_taken"):
    """Nobody takes the food here: go on with it."""

    place: Here = ""


class Choose(Command, frozen=True, forbid_unknown_fields=True, tag="choose"):
    """What a round that waits shall do."""

    choice: Literal["go_on", "kitchen", "end"]


class GoPlace(Command, frozen=True, forbid_unknown_fields=True, tag="go_place"):
    """Drive to a named place."""

    name: Name
    when: When = ""


class Cancel(Command, frozen=True, forbid_unknown_fields=True, tag="cancel"):
    """Give up the goal and the deliveries."""


class Stop(Command, frozen=True, forbid_unknown_fields=True, tag="stop"):
    """Stand still, and stay so until Resume."""

    id: Id = ""


class Withdraw(Command, frozen=True, forbid_unknown_fields=True, tag="withdraw"):
    """A Stop that the robot has not confirmed shall not count any more; one that it has stays."""

    id: Id


class Resume(Command, frozen=True, forbid_unknown_fields=True, tag="resume"):
    """Release STOP. `pressed`: when it was pressed that the person saw (ns); a later one is not released."""

    pressed: Id = ""


class Ping(Command, frozen=True, forbid_unknown_fields=True, tag="ping"):
    """Is the connection alive? Answered at once with the same number."""

    n: Annotated[int, msgspec.Meta(ge=0)]


class Drive(Command, frozen=True, forbid_unknown_fields=True, tag="drive"):
    """Drive by hand: forward and counter-clockwise are positive. Must be repeated (see `deadman`)."""

    v: Share
    w: Share

    @property
    def still(self) -> bool:
        """Whether it asks for no motion."""
        return self.v == 0 and self.w == 0


class DropBox(Command, frozen=True, forbid_unknown_fields=True, tag="drop_box"):
    """Simulation: put a box here."""

    x: Metre
    y: Metre


class OpenDoor(Command, frozen=True, forbid_unknown_fields=True, tag="open_door"):
    """Simulation: open the door of this name."""

    name: Name


class CloseDoor(Command, frozen=True, forbid_unknown_fields=True, tag="close_door"):
    """Simulation: close the door of this name."""

    name: Name


class Kidnap(Command, frozen=True, forbid_unknown_fields=True, tag="kidnap"):
    """Simulation: lift the robot and set it down here, without telling it."""

    x: Metre
    y: Metre
    yaw: Angle


KINDS = (
    *(Goal, InitialPose, Deliver, Loaded, Taken, NotTaken, Choose, GoPlace, Cancel),
    *(Stop, Withdraw, Resume, Ping, Drive),
    *(DropBox, OpenDoor, CloseDoor, Kidnap),
)
NAMES = tuple(str(kind.__struct_config__.tag) for kind in KINDS)

AnyCommand = (
    Goal | InitialPose | Deliver | Loaded | Taken | NotTaken | Choose | GoPlace | Cancel
    | Stop | Withdraw | Resume | Ping | Drive
    | DropBox | OpenDoor | CloseDoor | Kidnap
)  # fmt: skip
_DECODER = msgspec.json.Decoder(AnyCommand)


class _Head(msgspec.Struct):
    do: str = ""


_HEAD = msgspec.json.Decoder(_Head)


def parse_command(text: str) -> Command:
    """A command from the JSON text of a browser; UserError with a sentence for the operator if it is none."""
    try:
        return _DECODER.decode(text)
    except msgspec.ValidationError as error:
        raise UserError(_sentence(text, str(error))) from None
    except (msgspec.DecodeError, RecursionError):
        raise UserError("A message that is not JSON was refused; reload the page") from None


def _sentence(text: str, fault: str) -> str:
    """Why a well-formed JSON text is no command."""
    try:
        name = _HEAD.decode(text).do[:64]
    except (msgspec.DecodeError, RecursionError):
        name = ""
    if name not in NAMES:
        return f"Unknown command {name!r} was refused{nearest(name, NAMES)}"
    return f"Command {name!r} was refused: {fault.replace('`', '').replace('$.', '')}"
