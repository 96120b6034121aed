"""Base of the web UI's device: places and zones of the map, and their changes by an operator."""

from __future__ import annotations

import re
from collections import deque
from functools import partial
from itertools import count

from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import MapEdit, MapEditResult, MapStroke, Place, Places
from chefbot.msgs.chefbot_msgs.maps import ZONE_TITLES, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point
from chefbot.runtime.node import In, Out
from chefbot.ui import commands as do
from chefbot.ui.access.audit_log import Kind
from chefbot.ui.display.message_conversion import zone_views
from chefbot.ui.editing.mapping_device import MappingDevice

BRUSHES = {"wall": OCCUPIED, "free": FREE, "unknown": UNKNOWN}
"""Values of the cells that a brush draws."""
SHOWN_RESULTS = 8
"""Number of results that a browser gets together: a layer has its latest value only, and several people edit."""
MAX_REQUESTED = 64
"""Number of changes whose results are expected at most."""
AnyEdit = do.PutPlace | do.DeletePlace | do.PutZone | do.DeleteZone | do.UndoMapEdit


class MapEditDevice(MappingDevice):
    """Displays places and zones, and passes changes on to the map server, which reports what became of them."""

    places: In[Places]
    zones: In[MapZones]
    map_edit_result: In[MapEditResult]
    map_edit: Out[MapEdit]

    def start(self) -> None:
        """Start without places, until the first message."""
        super().start()
        self._places: dict[str, SE2] = {}
        self._results: deque[MapEditResult] = deque(maxlen=SHOWN_RESULTS)
        self._requested: dict[str, tuple[str, str]] = {}
        """Changes whose results are expected, by their `id`: the command, and who gave it."""

    def on_places(self, message: Places) -> None:
        """Display the named places on the map."""
        self._places = {place.name: place.pose.pose.se2 for place in message.places}
        self._server.set_layer("labels", {place.name: place.label for place in message.places if place.label})
        self._server.set_layer("places", self._places)

    def on_zones(self, message: MapZones) -> None:
        """Display the zones of the map."""
        self._server.set_layer("zones", zone_views(message))

    def on_map_edit_result(self, result: MapEditResult) -> None:
        """Display what became of the last changes of the map, the newest first."""
        self._results.appendleft(result)
        if result.id in self._requested:
            action, who = self._requested.pop(result.id)
            if not result.applied:
                details = {"id": result.id}
                self.audit.record(Kind.COMMAND, (who, "", ""), action, details, result.description)
        self._server.set_layer("edits", tuple(self._results))

    def _execute_map_edit(self, command: AnyEdit, who: str) -> None:
        make_edit = self._edit_by(command, who)
        match command:
            case do.PutPlace(x, y, yaw, name, moved, kind, label):
                pose = self._stamped(SE2(x, y, yaw))
                place = Place(name or self._new_place(kind), pose, label=label.strip())
                edit = make_edit(places=(place,), new=not name, keep_poses=not moved)
            case do.PutZone(name=name, preview=preview):
                zone = self._zone(command)
                replaced = (name,) if name not in ("", zone.name) else ()
                new = zone.name != name
                edit = make_edit(zones=(zone,), deleted_zones=replaced, new=new, preview=preview)
            case do.DeletePlace(name):
                edit = make_edit(deleted_places=(name,))
            case do.DeleteZone(name):
                edit = make_edit(deleted_zones=(name,))
            case do.UndoMapEdit():
                edit = make_edit(undo=True)
        self.map_edit.publish(edit)

    def _execute_map_change(self, command: do.DrawOnMap | do.CropMap | do.RotateMap, who: str) -> None:
        make_edit = self._edit_by(command, who)
        match command:
            case do.DrawOnMap(strokes, width, brush, preview):
                edit = make_edit(strokes=_strokes(strokes, width, BRUSHES[brush]), preview=preview)
            case do.CropMap(x, y, other_x, other_y, preview):
                corners = Point(x, y, 0.0), Point(other_x, other_y, 0.0)
                edit = make_edit(crop=corners, preview=preview)
            case do.RotateMap(angle, preview):
                edit = make_edit(rotation=angle, preview=preview)
        self.map_edit.publish(edit)

    def _edit_by(self, command: do.MapEditCommand, who: str) -> partial[MapEdit]:
        """Return what makes a change with the fields that do not depend on its kind."""
        if command.id and not getattr(command, "preview", False):
            if len(self._requested) >= MAX_REQUESTED:
                del self._requested[next(iter(self._requested))]  # its result was lost
            self._requested[command.id] = str(type(command).__struct_config__.tag), who
        return partial(MapEdit, id=command.id, seen_change=command.seen_change, edited_by=who)

    def _new_place(self, kind: str) -> str:
        """Return the first free name of a kind; a map has one kitchen as a rule."""
        if kind == "kitchen" and kind not in self._places:
            return kind
        return next(name for number in count(1) if (name := f"{kind}_{number}") not in self._places)

    def _zone(self, command: do.PutZone) -> MapZone:
        """Return the zone of a command; one that has a number of another kind gets one of its own kind."""
        corners = tuple(Point(x, y, 0.0) for x, y in command.corners)
        known = {zone.name for zone in self.zones.last.zones} if self.zones.last else set()
        new = next(name for number in count(1) if (name := f"{command.kind}_{number}") not in known)
        speed = command.speed if command.kind == "slow" else 0.0
        direction = command.direction if command.kind == "one_way" else 0.0
        numbered = re.fullmatch(rf"({'|'.join(ZONE_TITLES)})_\d+", command.name)
        kept = command.name if numbered is None or numbered[1] == command.kind else ""
        return MapZone(kept or new, command.kind, corners, speed, direction)


def _strokes(strokes: list[list[tuple[float, float]]], width: float, value: int) -> tuple[MapStroke, ...]:
    return tuple(MapStroke(tuple(Point(x, y, 0.0) for x, y in points), width, value) for points in strokes)
