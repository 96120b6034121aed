"""Named places in a YAML file beside the map: `hotel.places.yaml` beside `hotel.yaml`.

places:
  table_3: {x: 4.2 m, y: 1.5 m, yaw: 90 deg, label: "窗边 3"}
  dock: {x: 1.0 m, y: 0.2 m, yaw: 0 deg, xy_tolerance: 2 cm, yaw_tolerance: 2 deg}
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from ruamel.yaml.comments import CommentedMap

from chefbot.config import ConfigError, build, parse_yaml, read_bytes
from chefbot.errors import UserError, name_hint
from chefbot.file_kinds import PLACES, check_kind
from chefbot.maths.se2 import SE2
from chefbot.robot.quantities import Name
from chefbot.storage.commented_yaml import write_section

Coordinate = Annotated[float, Meta(ge=-1e7, le=1e7, extra={"unit": "m"})]
Heading = Annotated[float, Meta(ge=-7, le=7, extra={"unit": "rad"})]
PositionTolerance = Annotated[float, Meta(ge=0.01, le=1.0, extra={"unit": "m"})]
HeadingTolerance = Annotated[float, Meta(ge=0.01, le=3.15, extra={"unit": "rad"})]
Label = Annotated[str, Meta(max_length=40)]


class PlaceEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A pose in the map frame, and how exactly it has to be reached, in the words of Nav2's goal checker.

    Without tolerances those of the controller hold. People see `label`, in any script, instead of the name.
    """

    x: Coordinate
    y: Coordinate
    yaw: Heading = 0.0
    xy_tolerance: PositionTolerance | None = None
    yaw_tolerance: HeadingTolerance | None = None
    label: Label = ""


class PlacesFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The content of a places file."""

    places: dict[Name, PlaceEntry]


def places_path(map_path: Path) -> Path:
    """Return the path of the places file that belongs to a map."""
    return map_path.with_suffix(".places.yaml")


def entry_of(pose: SE2) -> PlaceEntry:
    """Return a place without tolerances of its own."""
    return PlaceEntry(x=pose.x, y=pose.y, yaw=pose.yaw)


def load_entries(path: Path) -> dict[str, PlaceEntry]:
    """Load the places by name; ConfigError with file and key if the file is invalid."""
    where = f"places file {path}"
    content = parse_yaml(read_bytes(path, "places file"), where)
    check_kind(content, PLACES, where, ConfigError)
    return build(content, PlacesFile, where).places


def load_places(path: Path) -> dict[str, SE2]:
    """Load the poses by name; ConfigError with file and key if the file is invalid."""
    return {name: SE2(place.x, place.y, place.yaw) for name, place in load_entries(path).items()}


def save_places(path: Path, places: Mapping[str, SE2]) -> None:
    """Write the poses (map frame) into the places file as `save_entries` does; labels and tolerances are kept."""
    known = load_entries(path) if path.is_file() else {}
    entries = {
        name: msgspec.structs.replace(known.get(name, entry_of(pose)), x=pose.x, y=pose.y, yaw=pose.yaw)
        for name, pose in places.items()
    }
    save_entries(path, entries)


def save_entries(path: Path, entries: Mapping[str, PlaceEntry]) -> None:
    """Write the places into the places file atomically; comments and unchanged places are kept."""
    empty = CommentedMap(places=CommentedMap())
    empty.yaml_set_start_comment("Named places on the map beside this file; edit freely.")
    known = load_entries(path) if path.is_file() else {}
    write_section(path, "places file", "places", _all_fields(entries), _all_fields(known), empty)


def _all_fields(entries: Mapping[str, PlaceEntry]) -> dict[str, CommentedMap]:
    return {name: _fields(entry) for name, entry in entries.items()}


def _fields(entry: PlaceEntry) -> CommentedMap:
    """Return a place as it is written: rounded, and without what it does not have."""
    fields = CommentedMap(
        x=f"{entry.x:.3f} m", y=f"{entry.y:.3f} m", yaw=f"{math.degrees(entry.yaw):.1f} deg"
    )
    if entry.xy_tolerance is not None:
        fields["xy_tolerance"] = f"{entry.xy_tolerance:.3f} m"
    if entry.yaw_tolerance is not None:
        fields["yaw_tolerance"] = f"{math.degrees(entry.yaw_tolerance):.1f} deg"
    if entry.label:
        fields["label"] = entry.label
    fields.fa.set_flow_style()
    return fields


def find_place(query: str, places: Collection[str], labels: Mapping[str, str] | None = None) -> str:
    """Return the place that 'kitchen', 'table_3', just '3' or its label refers to; UserError with the closest name.

    labels: label by name, of those that have one.
    """
    if query in places:
        return query
    labelled = [name for name, label in (labels or {}).items() if label.casefold() == query.casefold()]
    if len(labelled) == 1:
        return labelled[0]
    if labelled:
        raise UserError(f"several places are called {query!r}: {', '.join(labelled)}")
    name = name_of_place(query)
    if name in places:
        return name
    if "," in query:
        raise UserError(f"there is no place called {query!r}; separate several by spaces")
    hint = f" (known: {', '.join(sorted(places))})" if query.isdigit() else name_hint(name, places)
    raise UserError(f"there is no place called {query!r}{hint}")


def name_of_place(query: str) -> str:
    """Return the name that a person means: 'table_3' for the number 3, 'meeting_room' for 'Meeting room'."""
    return f"table_{query}" if query.isdigit() else query.lower().replace(" ", "_")
