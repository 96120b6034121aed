"""Zones in a YAML file beside the map: `hotel.zones.yaml` beside `hotel.yaml`.

version: 1
zones:
  stairs: {kind: keep_out, corners: [{x: 1 m, y: 2 m}, {x: 3 m, y: 2 m}, {x: 3 m, y: 4 m}]}
  ramp: {kind: slow, speed: 0.15 m/s, corners: [...]}
  corridor: {kind: preferred, corners: [...]}
  door_in: {kind: one_way, direction: 90 deg, corners: [...]}
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from chefbot.config import ConfigError, build, parse_yaml, read_bytes
from chefbot.file_kinds import ZONES, check_kind
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import (
    KEEP_OUT,
    MAX_CORNERS,
    MAX_ZONES,
    ONE_WAY,
    PREFERRED,
    SLOW_ZONE,
    MapZone,
)
from chefbot.msgs.geometry_msgs import Point
from chefbot.robot.quantities import Angle, Name
from chefbot.storage.commented_yaml import write_section
from chefbot.storage.places import Coordinate
from chefbot.zones.contradictions import ZoneError, ZoneReport, check_zones

VERSION = 1
"""Version of the file format."""
ZoneSpeed = Annotated[float, Meta(ge=0.1, le=10.0, extra={"unit": "m/s"})]


class ZoneCorner(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A corner of a zone in the map frame."""

    x: Coordinate
    y: Coordinate


class KeepOutZone(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind", tag=KEEP_OUT
):
    """An area that no part of the robot enters."""

    corners: tuple[ZoneCorner, ...]


class SlowZone(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind", tag=SLOW_ZONE
):
    """An area in which the robot drives no faster than `speed`."""

    corners: tuple[ZoneCorner, ...]
    speed: ZoneSpeed


class PreferredZone(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind", tag=PREFERRED
):
    """An area that paths prefer."""

    corners: tuple[ZoneCorner, ...]


class OneWayLane(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind", tag=ONE_WAY
):
    """An area in which paths lead in `direction`, from the x axis of the map counter-clockwise, or across it."""

    corners: tuple[ZoneCorner, ...]
    direction: Angle


class ZonesFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The content of a zones file."""

    version: int
    zones: dict[Name, KeepOutZone | SlowZone | PreferredZone | OneWayLane]


class LoadedZones(msgspec.Struct, frozen=True):
    """The zones of a map, and warnings about them, a sentence each."""

    zones: tuple[MapZone, ...] = ()
    warnings: tuple[str, ...] = ()


def zones_path(map_path: Path) -> Path:
    """Return the path of the zones file that belongs to a map."""
    return map_path.with_suffix(".zones.yaml")


def load_zones(path: Path, grid: Grid | None = None, places: Mapping[str, SE2] | None = None) -> LoadedZones:
    """Load zones and check them against each other, the map and its places.

    ConfigError with file and key if the file is invalid, and with the names of zones that cannot be obeyed.
    """
    where = f"zones file {path}"
    content = parse_yaml(read_bytes(path, "zones file"), where)
    check_kind(content, ZONES, where, ConfigError)
    file = build(content, ZonesFile, where)
    if file.version != VERSION:
        raise ConfigError(f"{where}: version {file.version} is unknown; this chefbot reads version {VERSION}")
    if len(file.zones) > MAX_ZONES:
        raise ConfigError(f"{where}: {len(file.zones)} zones are more than {MAX_ZONES}")
    zones = tuple(_zone(name, entry, where) for name, entry in file.zones.items())
    try:
        report: ZoneReport = check_zones(zones, grid, places or {})
    except ZoneError as error:
        raise ConfigError(f"{where}: {error}") from None
    return LoadedZones(zones, report.warnings)


def _zone(name: str, entry: KeepOutZone | SlowZone | PreferredZone | OneWayLane, where: str) -> MapZone:
    """Return a zone of the file as a message."""
    if len(entry.corners) > MAX_CORNERS:
        raise ConfigError(f"{where}: zone {name} has {len(entry.corners)} corners, more than {MAX_CORNERS}")
    corners = tuple(Point(corner.x, corner.y, 0.0) for corner in entry.corners)
    kind = str(type(entry).__struct_config__.tag)
    speed = entry.speed if isinstance(entry, SlowZone) else 0.0
    direction = entry.direction if isinstance(entry, OneWayLane) else 0.0
    return MapZone(name, kind, corners, speed, direction)


def save_zones(path: Path, zones: Sequence[MapZone]) -> None:
    """Write the zones into the zones file atomically; comments and unchanged zones are kept."""
    empty = CommentedMap(version=VERSION, zones=CommentedMap())
    empty.yaml_set_start_comment("Zones of the map beside this file; edit freely.")
    known = load_zones(path).zones if path.is_file() else ()
    write_section(path, "zones file", "zones", _all_fields(zones), _all_fields(known), empty)


def _all_fields(zones: Sequence[MapZone]) -> dict[str, CommentedMap]:
    return {zone.name: _fields(zone) for zone in zones}


def _fields(zone: MapZone) -> CommentedMap:
    """Return a zone as it is written."""
    fields = CommentedMap(kind=zone.kind)
    if zone.kind == SLOW_ZONE:
        fields["speed"] = f"{zone.speed:.2f} m/s"
    if zone.kind == ONE_WAY:
        fields["direction"] = f"{math.degrees(zone.direction):.1f} deg"
    corners = [CommentedMap(x=f"{corner.x:.3f} m", y=f"{corner.y:.3f} m") for corner in zone.corners]
    fields["corners"] = CommentedSeq(corners)
    fields["corners"].fa.set_flow_style()
    return fields
