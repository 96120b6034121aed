"""A map with its places and zones, and a change of them."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import MapZone
from chefbot.storage.places import PlaceEntry


class MapContent(NamedTuple):
    """The places by name, the zones, and the map."""

    places: dict[str, PlaceEntry]
    zones: tuple[MapZone, ...]
    grid: Grid

    def of_kind(self, kind: str) -> tuple[MapZone, ...]:
        """Return the zones of a kind."""
        return tuple(zone for zone in self.zones if zone.kind == kind)

    def poses(self) -> dict[str, SE2]:
        """Return the poses of the places by name."""
        return {name: SE2(entry.x, entry.y, entry.yaw) for name, entry in self.places.items()}


class MapChange(NamedTuple):
    """A map with its places and zones before a change and after it."""

    before: MapContent
    after: MapContent
