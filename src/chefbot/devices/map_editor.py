"""Changes of the places and zones of a map while a robot drives on it: checked, written, taken back."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import NamedTuple

import msgspec

from chefbot.devices.cut_off import cut_off
from chefbot.errors import ChefbotError, UserError, name_hint
from chefbot.maths.grid import OCCUPIED_FROM, Grid
from chefbot.maths.polygon import contains
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import MapEdit, Place
from chefbot.msgs.chefbot_places import KEEP_OUT, MAX_PLACES, MAX_ZONES, MapZone
from chefbot.robot.spec import Robot
from chefbot.storage.map_versions import MapVersions
from chefbot.storage.places import PlaceEntry, load_entries, places_path, save_entries
from chefbot.storage.zones import load_zones, save_zones
from chefbot.zones.contradictions import check_zones

NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
"""Names of places and zones; what people read is a place's label."""
MAX_LABEL = 40
"""Maximum length of a label, characters."""


class MapContent(NamedTuple):
    """The places by name, and the zones."""

    places: dict[str, PlaceEntry]
    zones: tuple[MapZone, ...]

    def of_kind(self, kind: str) -> tuple[MapZone, ...]:
        """Return the zones of a kind."""
        return tuple(zone for zone in self.zones if zone.kind == kind)

    def poses(self) -> dict[str, SE2]:
        """Return the poses of the places by name."""
        return {name: SE2(entry.x, entry.y, entry.yaw) for name, entry in self.places.items()}


class MapEditor:
    """Changes the files of places and zones beside a map; the versions before are in `NAME.versions`.

    The files are read before each change, so that one by hand is kept. `drawn`: places of a map without such a file.
    """

    def __init__(
        self, map_path: Path, zones_path: Path, grid: Grid, robot: Robot, drawn: Mapping[str, PlaceEntry]
    ) -> None:
        self._places, self._zones = places_path(map_path), zones_path
        self._grid, self._robot, self._drawn = grid, robot, dict(drawn)
        self.versions = MapVersions(map_path.with_suffix(".versions"), (self._places, self._zones))

    def content(self) -> MapContent:
        """Read the files. Raises ConfigError for an invalid one."""
        entries = load_entries(self._places) if self._places.is_file() else dict(self._drawn)
        zones = load_zones(self._zones).zones if self._zones.is_file() else ()
        return MapContent(entries, zones)

    def preview(self, edit: MapEdit, start: SE2 | None) -> str:
        """Return what a change would do, in sentences; empty if it has no side effects. Raises ChefbotError.

        start: the robot's pose in the map frame, from which the places are to be reached; None if it is not known.
        """
        before = self.content()
        return self._side_effects(before, self._changed(before, edit), start)

    def apply(self, edit: MapEdit) -> None:
        """Write a change. Raises ChefbotError if it is not valid or cannot be written; nothing has changed then."""
        before = self.content()
        after = self._changed(before, edit)
        if after == before:
            return
        self.versions.keep()
        try:
            if after.places != before.places:
                save_entries(self._places, after.places)
            if after.zones != before.zones:
                save_zones(self._zones, after.zones)
        except ChefbotError:
            self.versions.restore()
            raise
        self.versions.seal()

    def undo(self) -> None:
        """Take the last change back. Raises UserError if there is none."""
        if not self.versions.restore():
            raise UserError("There is no change of the map to take back")

    def _changed(self, before: MapContent, edit: MapEdit) -> MapContent:
        """Return the content after a change. Raises UserError or ZoneError if it is not valid."""
        _check_known("place", edit.deleted_places, list(before.places))
        _check_known("zone", edit.deleted_zones, [zone.name for zone in before.zones])
        places = {n: entry for n, entry in before.places.items() if n not in edit.deleted_places}
        zones = {zone.name: zone for zone in before.zones if zone.name not in edit.deleted_zones}
        for place in edit.places:
            name = _free_name(place.name, places) if edit.new else place.name
            places[name] = self._entry(place, places.get(name), keep_pose=edit.keep_poses)
            _check_label(name, places)
        for zone in edit.zones:
            name = _free_name(zone.name, zones) if edit.new else zone.name
            zones[name] = msgspec.structs.replace(zone, name=name)
        after = MapContent(places, tuple(zones.values()))
        _check_names([*places, *zones])
        if len(places) > MAX_PLACES or len(zones) > MAX_ZONES:
            raise UserError(f"a map has at most {MAX_PLACES} places and {MAX_ZONES} zones")
        check_zones(after.zones, self._grid, {})
        return after

    def _entry(self, place: Place, known: PlaceEntry | None, *, keep_pose: bool) -> PlaceEntry:
        """Return the entry of a changed place, which keeps its tolerances."""
        label = unicodedata.normalize("NFC", place.label.strip())
        if known and keep_pose:
            return msgspec.structs.replace(known, label=_checked(label))
        pose = place.pose.pose.se2
        if not self._grid.contains(pose.x, pose.y):
            raise UserError(f"{label or place.name} lies outside the map")
        if self._grid.at(pose.x, pose.y) >= OCCUPIED_FROM:
            raise UserError(f"{label or place.name} lies in a wall")
        tolerances = (known.xy_tolerance, known.yaw_tolerance) if known else (None, None)
        return PlaceEntry(
            x=pose.x,
            y=pose.y,
            yaw=pose.yaw,
            xy_tolerance=tolerances[0],
            yaw_tolerance=tolerances[1],
            label=_checked(label),
        )

    def _side_effects(self, before: MapContent, after: MapContent, start: SE2 | None) -> str:
        known = check_zones(before.zones, self._grid, before.poses()).warnings
        found = check_zones(after.zones, self._grid, after.poses()).warnings
        sentences = [sentence for sentence in found if sentence not in known]
        if start is not None and after.zones != before.zones:
            if traps := [
                zone.title for zone in after.of_kind(KEEP_OUT) if contains(zone.array, start.x, start.y)
            ]:
                return " ".join(
                    [*sentences, f"The robot stands in the {traps[0]} and cannot leave it by itself."]
                )
            lost = cut_off(self._grid, self._robot, start, after.poses(), before.zones, after.zones)
            outside = [name for name in lost if not any(f" {name} " in sentence for sentence in sentences)]
            sentences += [f"No way from the robot to: {', '.join(outside)}."] if outside else []
        return " ".join(sentences)


def _free_name(name: str, taken: Collection[str]) -> str:
    """Return a name that is not taken: itself, or with the next free number, as two people add at the same moment."""
    if name not in taken:
        return name
    stem = re.sub(r"_\d+$", "", name)
    return next(free for number in count(2) if (free := f"{stem}_{number}") not in taken)


def _checked(label: str) -> str:
    if len(label) > MAX_LABEL or not label.isprintable():
        raise UserError(f"the label must have at most {MAX_LABEL} printable characters")
    return label


def _check_label(name: str, places: Mapping[str, PlaceEntry]) -> None:
    """Raise UserError if people would take the place for another one: by its label, or by its name."""
    label = _as_read(places[name].label or name)
    for other, entry in places.items():
        if other != name and label in (_as_read(entry.label), _as_read(other)):
            raise UserError(f"Another place is called {places[name].label or name} already")


def _as_read(text: str) -> str:
    """Return a text in which what looks the same is the same: letters of any width and case, spaces and _."""
    return unicodedata.normalize("NFKC", text).casefold().replace("_", " ").strip()


def _check_names(names: Sequence[str]) -> None:
    for name in names:
        if not NAME.fullmatch(name):
            raise UserError(
                f"the name {name!r} must consist of small letters of English, digits and _, a letter first; "
                "a label may be in any script"
            )


def _check_known(kind: str, deleted: Sequence[str], known: Sequence[str]) -> None:
    for name in deleted:
        if name not in known:
            raise UserError(f"there is no {kind} {name!r} to delete{name_hint(name, known)}")
