"""Map server: publishes a saved map, its named places and its zones, and changes them."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.devices.initial_pose import initial_pose
from chefbot.devices.maps.edit_preview import side_effects
from chefbot.devices.maps.map_content import MapContent
from chefbot.devices.maps.map_editor import MapEditor
from chefbot.errors import ChefbotError, UserError
from chefbot.mapping.image_format import MapFormatError
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import MapEdit, MapEditResult, Place, Places
from chefbot.msgs.chefbot_msgs.maps import MapZones
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, PoseWithCovarianceStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import Device, In, Out, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.map_files import load_map, map_in
from chefbot.storage.map_versions import ChangeNote
from chefbot.storage.places import PlaceEntry, load_entries, places_path
from chefbot.storage.zones import LoadedZones, load_zones, zones_path

MAP_FILE_KIND = "chefbot.devices.maps.map_file:MapFileDevice"
SAVED_MAP_KIND = "chefbot.sim.world.saved_map:SavedMapDevice"
"""The map servers of a built and of a simulated robot, by their names in launch files."""

TURNED = "Initial poses in launch files do not turn with the map."
MAX_WAITING = 10
"""Number of changes that wait for the disk; more at once come from no person."""
TOO_MANY = "Too many changes of the map at once; this one was left out"


def given_map(path: str) -> Path:
    """Return the path of the map to localize on; a folder has a map.yaml. Raises UserError if none is given."""
    if not path:
        raise UserError(
            "no map is given: map_file:=MAP.yaml; `chefbot map save -f MAP` writes one while you map"
        )
    return map_in(Path(path))


class MapFileParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the map server: the paths of the map and of its zones."""

    map: Annotated[str, Meta(description="path of a ROS map file, NAME.yaml")]
    zones: Annotated[
        str, Meta(description="path of a zones file; empty: NAME.zones.yaml beside the map, if there is one")
    ] = ""


class MapFileDevice(Device):
    """Publishes map, places and zones, with transient local durability for late-joining subscribers.

    A change of the map, its places or zones is written and published at once.
    """

    params: MapFileParams
    world_frame = False
    """Whether the map has the frame of a simulated world, whose poses do not turn with it."""
    named: dict[str, PlaceEntry]
    _grid: Grid
    map: Out[OccupancyGrid] = topic(latched=True)
    places: Out[Places] = topic(latched=True)
    zones: Out[MapZones] = topic(latched=True)
    map_edit: In[MapEdit]
    map_edit_result: Out[MapEditResult] = topic(latched=True)
    initialpose: Out[PoseWithCovarianceStamped]

    def start(self) -> None:
        """Read the files now, so that an error aborts the start; publish as soon as the event loop runs."""
        self._edits = ThreadPoolExecutor(1, "map edits")  # in their order
        self._waiting = 0
        self.read()
        loaded = self._load_zones()
        self._zones, self.announcement = loaded.zones, " ".join(loaded.warnings)
        self._editor = MapEditor(self._path, self._zones_file(), self._grid, self.named)
        self.post(self._publish)

    def stop(self) -> None:
        """Finish the changes that have begun."""
        super().stop()
        self._edits.shutdown(cancel_futures=True)

    def on_map_edit(self, edit: MapEdit) -> None:
        """Apply a change of the map; a search for paths and the disk may take a while, so in a thread."""
        if self._waiting >= MAX_WAITING:
            self.map_edit_result.publish(self._result(edit.id, TOO_MANY))
            return
        self._waiting += 1
        self._edits.submit(self._edit, edit, self._robot_pose())

    def _edit(self, edit: MapEdit, pose: SE2 | None) -> None:
        """Apply a change, and have the result published."""
        content, problem, effects, rotation = None, "", "", edit.rotation
        try:
            if edit.rotation and self.world_frame:
                raise UserError("The map of a simulated world keeps its frame, so that it is not turned")
            if not edit.preview:
                self._editor.check_seen(edit)
            if edit.undo:
                rotation = self._editor.undo()
            else:
                change = self._editor.changed(edit)
                # places and zones turn with the walls, so that no path is closed
                effects = TURNED if edit.rotation else side_effects(self.robot, change, pose)
            if not (edit.undo or edit.preview):
                self._editor.apply(edit)
            content = None if edit.preview else self._editor.content()
        except ChefbotError as error:
            problem = str(error)
        except Exception as error:
            problem = f"The map server failed: {error!r}"
        result = self._result(edit.id, problem or effects, applied=content is not None)
        turned = SE2(0.0, 0.0, rotation) @ pose if rotation and pose is not None else None
        self.post(lambda: self._publish_edited(content, result, turned))

    def _result(self, identifier: str = "", description: str = "", *, applied: bool = False) -> MapEditResult:
        try:
            last = self._editor.versions.last_change()
        except StorageError as error:
            last = ChangeNote(description=str(error))
        return MapEditResult(
            id=identifier,
            applied=applied,
            description=description,
            undoable=len(self._editor.versions),
            last_id=last.id,
            last_change=last.description,
            last_edited_by=last.edited_by,
        )

    def _publish_edited(self, content: MapContent | None, result: MapEditResult, pose: SE2 | None) -> None:
        """Publish what has changed, and the robot's pose on a map that was turned."""
        self._waiting -= 1
        if content is not None:
            self.named, self._zones = content.places, content.zones
            if content.grid is not self._grid:
                self._grid = content.grid
                self._publish_map()
            if pose is not None:
                self.initialpose.publish(initial_pose(self.now_ns, pose))
            self._publish_names()
        self.map_edit_result.publish(result)

    def _robot_pose(self) -> SE2 | None:
        try:
            return self.tf.lookup("map", "base_link")
        except TransformError:
            return None

    def read(self) -> None:
        """Read the files given by the parameters."""
        self.read_map(given_map(self.params.map))

    def read_map(self, path: Path) -> None:
        """Read a map and the places file beside it, if there is one."""
        self._path, self._grid = path, load_map(path)
        if not (self._grid.cells >= OCCUPIED_THRESHOLD).any():
            raise MapFormatError(
                f"map file {path} has no occupied cell, so no scan can be matched to it; check its picture, mode and "
                "thresholds"
            )
        places_file = places_path(path)
        self.named = load_entries(places_file) if places_file.exists() else {}
        _check_on_map(self._grid, self.named, places_file)

    def _load_zones(self) -> LoadedZones:
        """Load the given zones file, else the one beside the map, else none."""
        path = self._zones_file()
        if not (self.params.zones or path.exists()):
            return LoadedZones()
        places = {name: SE2(entry.x, entry.y, entry.yaw) for name, entry in self.named.items()}
        return load_zones(path, self._grid, places)

    def _zones_file(self) -> Path:
        return Path(self.params.zones) if self.params.zones else zones_path(self._path)

    def _publish(self) -> None:
        self._publish_map()
        self._publish_names()
        self.map_edit_result.publish(self._result())

    def _publish_map(self) -> None:
        self.map.publish(OccupancyGrid.of(Header.of(self.now_ns, "map"), self._grid))

    def _publish_names(self) -> None:
        header = Header.of(self.now_ns, "map")
        self.places.publish(Places(tuple(_place(header, *named) for named in self.named.items())))
        self.zones.publish(MapZones(header, self._zones))


def _check_on_map(grid: Grid, named: Mapping[str, PlaceEntry], path: Path) -> None:
    """Raise UserError if a place lies outside the map."""
    for name, entry in named.items():
        if not grid.contains(entry.x, entry.y):
            raise UserError(
                f"places file {path}: {name} at ({entry.x:.2f}, {entry.y:.2f}) m lies outside the map, which extends "
                f"from ({grid.origin_x:.2f}, {grid.origin_y:.2f}) m over {grid.width * grid.resolution:.1f} x "
                f"{grid.height * grid.resolution:.1f} m; correct the place or remove it"
            )


def _place(header: Header, name: str, entry: PlaceEntry) -> Place:
    pose = PoseStamped(header, Pose.of(SE2(entry.x, entry.y, entry.yaw)))
    return Place(name, pose, entry.xy_tolerance or 0.0, entry.yaw_tolerance or 0.0, entry.label)
