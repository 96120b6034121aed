"""Commands of the operator: a strict struct per command, as JSON `{"do": "goal", "x": 1, ...}`."""

from __future__ import annotations

from typing import Annotated, Literal, get_args

import msgspec

from chefbot.errors import UserError, name_hint
from chefbot.ui.command_types import (
    Angle,
    GraphName,
    Here,
    Id,
    Metre,
    Name,
    PersonNumber,
    Rounds,
    Share,
    Tables,
    When,
)
from chefbot.ui.command_types import OperatorCommand as OperatorCommand
from chefbot.ui.map_commands import CropMap as CropMap
from chefbot.ui.map_commands import DeletePlace as DeletePlace
from chefbot.ui.map_commands import DeleteZone as DeleteZone
from chefbot.ui.map_commands import DrawOnMap as DrawOnMap
from chefbot.ui.map_commands import DriveOnMap as DriveOnMap
from chefbot.ui.map_commands import Explore as Explore
from chefbot.ui.map_commands import MapBuilding as MapBuilding
from chefbot.ui.map_commands import MapEditCommand as MapEditCommand
from chefbot.ui.map_commands import PutPlace as PutPlace
from chefbot.ui.map_commands import PutZone as PutZone
from chefbot.ui.map_commands import ResetMap as ResetMap
from chefbot.ui.map_commands import RotateMap as RotateMap
from chefbot.ui.map_commands import SaveMap as SaveMap
from chefbot.ui.map_commands import SendMap as SendMap
from chefbot.ui.map_commands import UndoMapEdit as UndoMapEdit
from chefbot.validation_text import validation_error_text

MAX_TEXT = 64_000
"""Maximum size of a message from a browser, bytes."""


class Goal(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="goal"):
    """Drive to a pose in the map frame."""

    x: Metre
    y: Metre
    yaw: Angle
    when: When = ""


class InitialPose(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="initial_pose"):
    """Start localization from an approximate pose."""

    x: Metre
    y: Metre
    yaw: Angle


class Deliver(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="deliver"):
    """Deliver food to these tables, in this order."""

    tables: Tables


class Loaded(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="loaded"):
    """Confirm that the food is on the tray: the robot leaves the kitchen."""

    place: Here = ""


class Taken(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="taken"):
    """Confirm that the guest has taken the food: the robot continues."""

    place: Here = ""


class NotTaken(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="not_taken"):
    """Report that nobody takes the food here: the robot continues with it."""

    place: Here = ""


class Choose(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="choose"):
    """Choose how a waiting round continues."""

    choice: Literal["go_on", "kitchen", "end"]


class ChangeQueue(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="queue"):
    """Serve the tables that are left in this order, without those that are missing in it.

    `order`: id of the round that the operator saw, or of an order that waits; without a table that one is cancelled.
    `seen`: the tables that were left when the operator looked; None does not compare them.
    """

    tables: Annotated[list[Name], msgspec.Meta(max_length=32)]
    order: Id = ""
    seen: Annotated[list[Name], msgspec.Meta(max_length=32)] | None = None


class ShortestOrder(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="shortest_order"):
    """Serve the remaining tables by the shortest route; `order` as in ChangeQueue."""

    order: Id = ""


class GoPlace(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="go_place"):
    """Drive to the place with this name."""

    name: Name
    when: When = ""


class Patrol(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="patrol"):
    """Drive to these places in this order, or through them without stopping, in some rounds; 0: until Cancel."""

    places: Tables
    rounds: Rounds = 1
    without_stops: bool = False


class Follow(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="follow"):
    """Follow a tracked person by number; 0: the nearest one ahead of the robot."""

    person: PersonNumber = 0


class Cancel(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="cancel"):
    """Cancel the goal, a patrol, the following and all deliveries."""


class Stop(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="stop"):
    """Stop the robot until ReleaseStop (emergency stop)."""

    id: Id = ""


class Withdraw(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="withdraw"):
    """Withdraw a Stop that the robot has not confirmed yet; a confirmed one stays in force."""

    id: Id


class ReleaseStop(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="release_stop"):
    """Release the emergency stop that the operator saw.

    `pressed`: time stamp (ns) of the press that the operator saw; a later one is not released.
    """

    pressed: Id = ""


class MapSaved(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="map_saved"):
    """Record in the audit log that the map was saved to a file of this name."""

    file: Name


class Inspect(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="inspect"):
    """Show the ROS graph, the newest messages of these topics and the parameters of these nodes for some seconds."""

    topics: Annotated[list[GraphName], msgspec.Meta(max_length=12)]
    nodes: Annotated[tuple[GraphName, ...], msgspec.Meta(max_length=4)] = ()


class SetParameter(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="set_parameter"):
    """Set a parameter of a node while it runs; the node may refuse it."""

    node: GraphName
    name: GraphName
    value: bool | int | float | str | list[bool | int | float | str]


class InspectCell(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="inspect_cell"):
    """Show the cost of a cell of the global costmap, and what marked it."""

    x: Metre
    y: Metre


class SaveIncident(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="save_incident"):
    """Save the last minute as a file for later analysis."""

    note: Annotated[
        str, msgspec.Meta(max_length=200, description="what happened, in the operator's words")
    ] = ""


class Record(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="record"):
    """Begin to record what the robot sees and does, with the last minute, or end the recording that is under way."""

    on: bool
    note: Annotated[
        str, msgspec.Meta(max_length=200, description="what it shows, in the operator's words")
    ] = ""


class Playback(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="playback"):
    """Of a recording: jump to a time, s after its begin, and set the rate; 0 pauses it."""

    time: Annotated[float, msgspec.Meta(ge=0, le=1e9)] | None = None
    rate: Annotated[float, msgspec.Meta(ge=0, le=20)] | None = None


class Ping(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="ping"):
    """Check the connection; it is answered at once with the same number."""

    n: Annotated[int, msgspec.Meta(ge=0)]


class Show(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="show"):
    """Send only these layers to this browser from now on; `stop` and `status` are always sent."""

    layers: Annotated[list[Name], msgspec.Meta(max_length=64)]


class Received(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="received"):
    """Number of pieces of bulk layers that the browser has received on this connection, so that few are under way."""

    n: Annotated[int, msgspec.Meta(ge=0)]


class LeaveKiosk(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="leave_kiosk"):
    """Leave the view on the robot's own screen; refused with a wrong PIN."""

    pin: Annotated[str, msgspec.Meta(max_length=8)]


class Drive(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="drive"):
    """Drive manually: forward and counter-clockwise are positive. It must be repeated (see `dead_man`)."""

    v: Share
    w: Share

    @property
    def is_zero(self) -> bool:
        """Whether the command requests no motion."""
        return self.v == 0 and self.w == 0


class DropBox(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="drop_box"):
    """Simulation: add a box at this position."""

    x: Metre
    y: Metre


class OpenDoor(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="open_door"):
    """Simulation: open the door with this name."""

    name: Name


class CloseDoor(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="close_door"):
    """Simulation: close the door with this name."""

    name: Name


class Kidnap(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="kidnap"):
    """Simulation: move the robot to this pose without a message to it (kidnapped robot problem)."""

    x: Metre
    y: Metre
    yaw: Angle


AnyCommand = (
    Goal | InitialPose | Deliver | Loaded | Taken | NotTaken | Choose | ChangeQueue | ShortestOrder | GoPlace
    | Patrol | Follow | Cancel
    | PutPlace | DeletePlace | PutZone | DeleteZone | DrawOnMap | CropMap | RotateMap
    | UndoMapEdit | Explore | ResetMap | SaveMap | SendMap | MapBuilding | DriveOnMap | Inspect | SetParameter
    | InspectCell
    | Stop | Withdraw | ReleaseStop | MapSaved | SaveIncident | Record | Playback | Ping | Show | Received
    | LeaveKiosk | Drive | DropBox | OpenDoor | CloseDoor | Kidnap
)  # fmt: skip
KINDS: tuple[type[OperatorCommand], ...] = get_args(AnyCommand)
NAMES = tuple(str(kind.__struct_config__.tag) for kind in KINDS)
_DECODER = msgspec.json.Decoder(AnyCommand)


class _Tag(msgspec.Struct):
    do: str = ""


_TAG_DECODER = msgspec.json.Decoder(_Tag)


def parse_command(text: str) -> OperatorCommand:
    """Parse a command from the JSON text of a browser; UserError with a sentence for the operator if it is
    invalid."""
    try:
        return _DECODER.decode(text)
    except msgspec.ValidationError as error:
        raise UserError(_explain(text, error)) from None
    except (msgspec.DecodeError, RecursionError):
        raise UserError("A message that is not JSON was refused; reload the page") from None


def _explain(text: str, error: msgspec.ValidationError) -> str:
    """Explain why a well-formed JSON text is not a valid command."""
    try:
        name = _TAG_DECODER.decode(text).do[:64]
    except (msgspec.DecodeError, RecursionError):
        name = ""
    if name not in NAMES:
        return f"Unknown command {name!r} was refused{name_hint(name, NAMES)}"
    return f"Command {name!r} was refused: {validation_error_text(error)}"
