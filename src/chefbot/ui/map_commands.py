"""Commands of the operator that change the map, its places and its zones."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from chefbot.ui.command_types import Angle, EditName, Id, Metre, Name, OperatorCommand

MapName = Annotated[
    str, msgspec.Meta(pattern=r"^[A-Za-z0-9_-]{1,40}$", description="letters, digits, _ and -")
]


class MapEditCommand(OperatorCommand, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Base of the changes of a map; with `seen_change`, one is refused if another person has changed the map since.

    `seen_change`: the id of the last change that the person knew when this one was begun.
    """

    id: Id = ""
    seen_change: Id = ""


class PutPlace(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="put_place"):
    """Add a place to the map, or change it; without a name it becomes the next one of its kind.

    `moved`: whether a place that exists gets this pose; else only its label is changed.
    """

    x: Metre
    y: Metre
    yaw: Angle
    name: EditName = ""
    moved: bool = True
    kind: Literal["table", "room", "kitchen", "charger", "pick_up"] = "table"
    label: Annotated[str, msgspec.Meta(max_length=40, description="what people read; in any script")] = ""


class PutZone(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="put_zone"):
    """Add a zone to the map, or change it; without a name it becomes the next one of its kind.

    `preview`: only report what it would do.
    """

    corners: Annotated[list[tuple[Metre, Metre]], msgspec.Meta(min_length=3, max_length=200)]
    kind: Literal["keep_out", "slow", "preferred", "one_way"]
    name: EditName = ""
    speed: Annotated[float, msgspec.Meta(ge=0.1, le=10.0, description="limit of a slow zone, m/s")] = 0.15
    direction: Angle = 0.0
    preview: bool = False


class DeletePlace(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="delete_place"):
    """Remove a place from the map."""

    name: Name


class DeleteZone(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="delete_zone"):
    """Remove a zone from the map."""

    name: Name


Stroke = Annotated[list[tuple[Metre, Metre]], msgspec.Meta(min_length=1, max_length=2000)]


class DrawOnMap(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="draw_on_map"):
    """Draw strokes of a brush on the map: walls, free floor, or unknown.

    `preview`: only report what it would do.
    """

    strokes: Annotated[list[Stroke], msgspec.Meta(min_length=1, max_length=200)]
    width: Annotated[float, msgspec.Meta(ge=0, le=5, description="of the brush, m")]
    brush: Literal["wall", "free", "unknown"]
    preview: bool = False


class CropMap(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="crop_map"):
    """Keep only the part of the map between two opposite corners; `preview` as in DrawOnMap."""

    x: Metre
    y: Metre
    other_x: Metre
    other_y: Metre
    preview: bool = False


class RotateMap(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="rotate_map"):
    """Turn the map, its places and zones about the origin of its frame; `preview` as in DrawOnMap."""

    angle: Angle
    preview: bool = False


class Explore(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="explore"):
    """While mapping: explore by itself, or end that."""

    on: bool


class ResetMap(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="reset_map"):
    """While mapping: begin an empty map where the robot is."""


class SaveMap(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="save_map"):
    """Save the map under a name on the computer that serves the web UI; `replace` one of the same name.

    Its outcome has the same id.
    """

    name: MapName
    replace: bool = False
    id: Id = ""


class SendMap(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="send_map"):
    """While mapping: adjust the map and send it with its drive as the layer `map_bundle`, with this id."""

    id: Id


class MapBuilding(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="map_building"):
    """End the present launch and map the building: a new map, or with `continued` the present one, longer."""

    continued: bool = False


class DriveOnMap(OperatorCommand, frozen=True, forbid_unknown_fields=True, tag="drive_on_map"):
    """End mapping, and localize and deliver on the map that was saved under a name."""

    name: MapName


class UndoMapEdit(MapEditCommand, frozen=True, forbid_unknown_fields=True, tag="undo_map_edit"):
    """Take the last change of the map, its places or its zones back."""
