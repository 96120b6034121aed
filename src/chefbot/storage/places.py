"""Named places in a YAML file beside the map: `hotel.places.yaml` beside `hotel.yaml`.

places:
  table_3: {x: 4.2 m, y: 1.5 m, yaw: 90 deg}
  dock: {x: 1.0 m, y: 0.2 m, yaw: 0 deg, xy_tolerance: 2 cm, yaw_tolerance: 2 deg}
"""

from __future__ import annotations

import io
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import YAMLError

from chefbot.config import ConfigError, build, parse_yaml, read_bytes
from chefbot.errors import UserError, name_hint
from chefbot.file_kinds import PLACES, check_kind
from chefbot.maths.se2 import SE2
from chefbot.robot.quantities import Name
from chefbot.storage.atomic_files import write_atomic

Coordinate = Annotated[float, Meta(ge=-1e7, le=1e7, extra={"unit": "m"})]
Heading = Annotated[float, Meta(ge=-7, le=7, extra={"unit": "rad"})]
PositionTolerance = Annotated[float, Meta(ge=0.01, le=1.0, extra={"unit": "m"})]
HeadingTolerance = Annotated[float, Meta(ge=0.01, le=3.15, extra={"unit": "rad"})]


LINE_WIDTH = 200
"""Characters up to which a place stays on one line of the file."""


class PlaceEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A pose in the map frame, and how exactly it has to be reached, in the words of Nav2's goal checker.

    Without tolerances those of the controller hold.
    """

    x: Coordinate
    y: Coordinate
    yaw: Heading = 0.0
    xy_tolerance: PositionTolerance | None = None
    yaw_tolerance: HeadingTolerance | None = None


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
    """Write the poses (map frame) into the places file atomically; comments and unchanged places are kept."""
    yaml = YAML()
    yaml.width = LINE_WIDTH
    file, known = _loaded(path, yaml)
    entries, written = file["places"], {name: _entry(pose) for name, pose in known.items()}
    for name in [name for name in entries if name not in places]:
        del entries[name]
    for name, pose in places.items():
        if written.get(name) != _entry(pose):
            entries.setdefault(name, _entry(pose)).update(_entry(pose))
    stream = io.BytesIO()
    yaml.dump(file, stream)
    write_atomic(path, stream.getvalue())


def _loaded(path: Path, yaml: YAML) -> tuple[CommentedMap, dict[str, SE2]]:
    """Return the content of a places file with its comments, and its poses; empty if there is no file."""
    if path.is_file():
        known = load_places(path)
        try:
            return yaml.load(path.read_bytes()), known
        except YAMLError as error:  # it keeps comments, and reads a little less than the loader
            raise ConfigError(f"places file {path} cannot be changed: {_problem(error)}") from None
    file = CommentedMap({"places": CommentedMap()})
    file.yaml_set_start_comment("Named places on the map beside this file; edit freely.")
    return file, {}


def _problem(error: YAMLError) -> str:
    """Return in one line what the parser does not accept, as a tab between two words."""
    problem, mark = getattr(error, "problem", None), getattr(error, "problem_mark", None)
    return f"{problem or 'it is not plain YAML'}{f' in line {mark.line + 1}' if mark else ''}"


def _entry(pose: SE2) -> CommentedMap:
    entry = CommentedMap(x=f"{pose.x:.3f} m", y=f"{pose.y:.3f} m", yaw=f"{math.degrees(pose.yaw):.1f} deg")
    entry.fa.set_flow_style()
    return entry


def find_place(query: str, places: Collection[str]) -> str:
    """Return the place that 'kitchen', 'table_3' or just '3' refers to; UserError with the closest name."""
    if query in places:
        return query
    name = f"table_{query}" if query.isdigit() else query.lower().replace(" ", "_")
    if name not in places:
        hint = f" (known: {', '.join(sorted(places))})" if query.isdigit() else name_hint(name, places)
        raise UserError(f"there is no place called {query!r}{hint}")
    return name
