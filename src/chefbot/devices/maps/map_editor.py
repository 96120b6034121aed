"""Changes of a map, its places and its zones while a robot drives on it: checked, written, taken back."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from itertools import count
from pathlib import Path

import msgspec

from chefbot.devices.maps.edit_description import edit_description
from chefbot.devices.maps.grid_edit import changes_grid, edited_grid, same_cells, turned_entry, turned_zone
from chefbot.devices.maps.map_content import MapChange, MapContent
from chefbot.errors import UserError, name_hint
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.msgs.chefbot_msgs import MapEdit, Place
from chefbot.msgs.chefbot_msgs.maps import MAX_PLACES, MAX_ZONES
from chefbot.place_names import display_name
from chefbot.storage.atomic_files import os_errors_as_storage_errors, write_atomic
from chefbot.storage.map_bundle import BUNDLE_SUFFIX
from chefbot.storage.map_files import load_map, map_png, read_map_files, save_map
from chefbot.storage.map_versions import ChangeNote, versions_of
from chefbot.storage.places import PlaceEntry, load_entries, places_path, save_entries
from chefbot.storage.zones import load_zones, save_zones
from chefbot.zones.contradictions import check_zones

NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
"""Names of places and zones; what people read is a place's label."""
OUTSIDE, IN_A_WALL = "lies outside the map", "lies in a wall"
"""Why a place cannot be where it is."""
MAX_LABEL = 40
"""Maximum length of a label, characters."""


class MapEditor:
    """Changes the files of a map, and of places and zones beside it; the versions before are in `NAME.versions`.

    The files are read before each change, so that one by hand is kept. `drawn`: places of a map without such a file.
    """

    grid: Grid
    """The map as it is now."""

    def __init__(self, map_path: Path, zones_path: Path, grid: Grid, drawn: Mapping[str, PlaceEntry]) -> None:
        self._map, self._places, self._zones = map_path, places_path(map_path), zones_path
        self.grid, self._drawn = grid, dict(drawn)
        self._map_files = (map_path, map_path.with_suffix(".pgm"))
        self.versions = versions_of(map_path, zones_path)

    def content(self) -> MapContent:
        """Read the files. Raises ConfigError for an invalid one."""
        entries = load_entries(self._places) if self._places.is_file() else dict(self._drawn)
        zones = load_zones(self._zones).zones if self._zones.is_file() else ()
        return MapContent(entries, zones, self.grid)

    def changed(self, edit: MapEdit) -> MapChange:
        """Return what a change would make of the files as they are now. Raises ChefbotError if it is not valid."""
        before = self.content()
        return MapChange(before, self._changed(before, edit))

    def apply(self, edit: MapEdit) -> bool:
        """Write a change and return whether there was one.

        Raises ChefbotError if it is not valid or cannot be written; nothing has changed then.
        """
        change = before, after = self.changed(edit)
        if after == before:
            return False
        files = self._map_files if after.grid is not before.grid else ()
        drives = self._drives_in_old_frame(edit) if files else ()
        changing = (self._places, self._zones, *files, *drives)
        with self.versions.change(changing, self._note(edit, change)):
            if after.places != before.places:
                save_entries(self._places, after.places)
            if after.zones != before.zones:
                save_zones(self._zones, after.zones)
            if files:
                self._save_map(after.grid)
            for drive in drives:
                with os_errors_as_storage_errors(drive):
                    drive.unlink()
        self.grid = after.grid
        return True

    def _note(self, edit: MapEdit, change: MapChange) -> ChangeNote:
        identifier = edit.id or f"change {len(self.versions) + 1}"
        return ChangeNote(identifier, edit_description(edit, change), edit.edited_by, edit.rotation)

    def check_seen(self, edit: MapEdit) -> None:
        """Raise UserError if the editor does not know the last change, which the edit might overwrite."""
        last = self.versions.last_change()
        if edit.seen_change and edit.seen_change != last.id:
            raise UserError(changed_since(last))

    def _drives_in_old_frame(self, edit: MapEdit) -> tuple[Path, ...]:
        """Return the bundle with which the map could be continued, but only in the frame before a rotation."""
        drive = self._map.with_suffix(BUNDLE_SUFFIX)
        return (drive,) if edit.rotation and drive.is_file() else ()

    def _save_map(self, grid: Grid) -> None:
        """Write the map. Raises UserError if its picture would replace that of another map."""
        if self._map.suffix == BUNDLE_SUFFIX:
            raise UserError(f"{self._map} is not changed; drive on the map.yaml beside it to change the map")
        about, picture = read_map_files(self._map).description, self._map.with_suffix(".pgm")
        if picture.exists() and picture.resolve() != (self._map.parent / about.image).resolve():
            raise UserError(f"{picture} is the picture of another map; rename it, or this map")
        # other modes than trinary have more levels than three
        drawn = self._drawing()
        save_map(self._map, grid, "trinary" if about.mode == "trinary" else "raw")
        if drawn is not None:
            write_atomic(drawn, map_png(grid))

    def _drawing(self) -> Path | None:
        """Return the picture that `chefbot map slam` has drawn of the present map, if it is beside it.

        Any other picture belongs to a person, or is the image of the map itself.
        """
        drawn = self._map.with_suffix(".png")
        if not drawn.is_file() or drawn.read_bytes() != map_png(self.grid):
            return None
        image = self._map.parent / read_map_files(self._map).description.image
        return drawn if drawn.resolve() != image.resolve() else None

    def undo(self) -> float:
        """Undo the last change, and return by how much that turns the map, rad. Raises UserError without one."""
        drawn = self._drawing()
        restored = self.versions.restore()
        if not restored.files:
            raise UserError("There is no map change to undo")
        if self._map in restored.files:
            self.grid = load_map(self._map)
            if drawn is not None:
                write_atomic(drawn, map_png(self.grid))
        return -restored.note.rotation

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
        grid = before.grid
        if changes_grid(edit):
            current = load_map(self._map)  # the picture may have been changed by hand
            edited = edited_grid(current, edit)
            grid = grid if same_cells(edited, current) and same_cells(current, grid) else edited
            # a place that lies in a wall already, as one that was drawn by hand, forbids no other change
            blocked = {name for name, entry in places.items() if _problem(current, entry) == IN_A_WALL}
            places = {name: turned_entry(entry, edit.rotation) for name, entry in places.items()}
            zones = {name: turned_zone(zone, edit.rotation) for name, zone in zones.items()}
            _check_poses(grid, {name: entry for name, entry in places.items() if name not in blocked})
        after = MapContent(places, tuple(zones.values()), grid)
        _check_names([*places, *zones])
        if len(places) > MAX_PLACES or len(zones) > MAX_ZONES:
            raise UserError(f"a map has at most {MAX_PLACES} places and {MAX_ZONES} zones")
        check_zones(after.zones, grid, {})
        return after

    def _entry(self, place: Place, known: PlaceEntry | None, *, keep_pose: bool) -> PlaceEntry:
        """Return the entry of a changed place, which keeps its tolerances."""
        label = " ".join(filter(None, unicodedata.normalize("NFC", place.label).split(" ")))
        if known and keep_pose:
            return msgspec.structs.replace(known, label=_checked(label))
        pose = place.pose.pose.se2
        tolerances = (known.xy_tolerance, known.yaw_tolerance) if known else (None, None)
        entry = PlaceEntry(
            x=pose.x,
            y=pose.y,
            yaw=pose.yaw,
            xy_tolerance=tolerances[0],
            yaw_tolerance=tolerances[1],
            label=_checked(label),
        )
        _check_poses(self.grid, {place.name: entry})
        return entry


def changed_since(change: ChangeNote) -> str:
    """Return the refusal of a change by a person who has not seen the last one, which it names."""
    who = f", by {change.edited_by}" if change.edited_by else ""
    last = f" (last change: {change.description}{who})" if change.description else ""
    return f"The map has changed in the meantime{last}; look at it and press again"


def _free_name(name: str, taken: Collection[str]) -> str:
    """Return a name that is not taken: itself, or with the next free number, as two people add at the same moment."""
    if name not in taken:
        return name
    stem = re.sub(r"_\d+$", "", name)
    return next(free for number in count(2) if (free := f"{stem}_{number}") not in taken)


def _check_poses(grid: Grid, places: Mapping[str, PlaceEntry]) -> None:
    """Raise UserError with every place that lies outside the map or in a wall."""
    problems = [
        f"{display_name(name, entry.label)} {problem}"
        for name, entry in places.items()
        if (problem := _problem(grid, entry))
    ]
    if problems:
        raise UserError("; ".join(problems))


def _problem(grid: Grid, entry: PlaceEntry) -> str:
    if not grid.contains(entry.x, entry.y):
        return OUTSIDE
    return IN_A_WALL if grid.at(entry.x, entry.y) >= OCCUPIED_THRESHOLD else ""


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
    return " ".join(unicodedata.normalize("NFKC", text).casefold().replace("_", " ").split())


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
