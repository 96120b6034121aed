"""Zones as a zone set of VDA 5050 3.0.0 (schema zoneSet), the interface of fleet managers to mobile robots."""

from __future__ import annotations

import hashlib
import math
from typing import Any

from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, PREFERRED, SLOW_ZONE, MapZone

VERSION = "3.0.0"
ZONE_TYPES = {KEEP_OUT: "BLOCKED", SLOW_ZONE: "SPEED_LIMIT", PREFERRED: "PRIORITY", ONE_WAY: "DIRECTED"}
"""Zone types of VDA 5050 by kind of zone."""
PRIORITY_FACTOR = 0.33
"""Preference over an area without a zone, 0 to 1: the share of the highest cost that other floor costs here."""


def zone_set(zones: tuple[MapZone, ...], map_id: str) -> dict[str, Any]:
    """Return the zone set of a map. The same zones have the same `zoneSetId`."""
    content = [_zone(zone) for zone in zones]
    digest = hashlib.sha256(repr(content).encode()).hexdigest()[:12]
    return {"mapId": map_id, "zoneSetId": f"{map_id}-{digest}", "zones": content}


def zone_set_message(zones: tuple[MapZone, ...], map_id: str, robot: str, timestamp: str) -> dict[str, Any]:
    """Return the message of the topic `zoneSet`. timestamp: as 2026-01-31T09:05:00.000Z."""
    header = {
        "headerId": 0,
        "timestamp": timestamp,
        "version": VERSION,
        "manufacturer": "chefbot",
        "serialNumber": robot,
    }
    return {**header, "zoneSet": zone_set(zones, map_id)}


def _zone(zone: MapZone) -> dict[str, Any]:
    vertices = [{"x": round(corner.x, 3), "y": round(corner.y, 3)} for corner in zone.corners]
    common = {
        "zoneId": zone.name,
        "zoneType": ZONE_TYPES[zone.kind],
        "zoneDescriptor": zone.title,
        "vertices": vertices,
    }
    return {**common, **_fields(zone)}


def _fields(zone: MapZone) -> dict[str, Any]:
    """Return what the type of a zone needs besides."""
    if zone.kind == SLOW_ZONE:
        return {"maximumSpeed": zone.speed}
    if zone.kind == PREFERRED:
        return {"priorityFactor": PRIORITY_FACTOR}
    if zone.kind == ONE_WAY:
        # obstacles are avoided, but no path leads against the lane
        direction = math.remainder(zone.direction, math.tau)
        return {"direction": round(direction, 4), "directedLimitation": "RESTRICTED"}
    return {}
