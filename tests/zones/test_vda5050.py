"""Zones as a zone set of VDA 5050: each kind with the fields that its type needs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from chefbot.cli.map.zones import export_zones
from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, PREFERRED, SLOW_ZONE, MapZone
from chefbot.msgs.geometry_msgs import Point
from chefbot.storage.map_files import load_map, save_map
from chefbot.storage.zones import save_zones, zones_path
from chefbot.zones.vda5050 import zone_set, zone_set_message

REQUIRED = {
    "BLOCKED": set(),
    "SPEED_LIMIT": {"maximumSpeed"},
    "PRIORITY": {"priorityFactor"},
    "DIRECTED": {"direction", "directedLimitation"},
}
"""The fields that the schema requires of a type, beside those of every zone."""


def zone(name: str, kind: str, left: float, speed: float = 0.0, direction: float = 0.0) -> MapZone:
    corners = ((left, 1.0), (left + 1.0, 1.0), (left + 1.0, 2.0), (left, 2.0))
    return MapZone(name, kind, tuple(Point(x, y, 0.0) for x, y in corners), speed, direction)


ZONES = (
    zone("stairs", KEEP_OUT, 0.5),
    zone("ramp", SLOW_ZONE, 2.0, speed=0.2),
    zone("aisle", PREFERRED, 3.5),
    zone("lane", ONE_WAY, 5.0, direction=4.7124),
)


def test_each_zone_has_the_fields_of_its_type() -> None:
    made = zone_set(ZONES, "floor")["zones"]
    assert [one["zoneType"] for one in made] == list(REQUIRED)
    for one in made:
        assert set(one) == {"zoneId", "zoneType", "zoneDescriptor", "vertices"} | REQUIRED[one["zoneType"]]
        assert len(one["vertices"]) == 4 and all(set(vertex) == {"x", "y"} for vertex in one["vertices"])
    assert made[1]["maximumSpeed"] == 0.2 and 0.0 <= made[2]["priorityFactor"] <= 1.0
    assert (
        made[3]["direction"] == pytest.approx(-1.5707, abs=1e-3)
        and made[3]["directedLimitation"] == "RESTRICTED"
    )


def test_a_changed_zone_changes_the_id_of_the_set() -> None:
    first, same, other = (zone_set(zones, "floor") for zones in (ZONES, ZONES, ZONES[:3]))
    assert first["zoneSetId"] == same["zoneSetId"] != other["zoneSetId"]
    message = zone_set_message(ZONES, "floor", "r7", "2026-01-31T09:05:00.000Z")
    assert message["zoneSet"] == first and message["serialNumber"] == "r7" and message["version"] == "3.0.0"


def test_the_command_writes_masks_and_zone_set(tmp_path: Path) -> None:
    cells = np.zeros((60, 140), np.int8)
    cells[0] = 100
    path = save_map(tmp_path / "floor.yaml", Grid(cells, 0.05, 0.0, 0.0))
    with pytest.raises(UserError, match="no zones file"):
        export_zones(path, tmp_path / "out", "r7")
    save_zones(zones_path(path), ZONES)
    export_zones(path, tmp_path / "out", "r7")
    written = json.loads((tmp_path / "out" / "zoneSet.json").read_text())
    assert written["zoneSet"]["mapId"] == "floor" and len(written["zoneSet"]["zones"]) == 4
    keep_out, speed = (load_map(tmp_path / "out" / f"{name}_mask.yaml") for name in ("keepout", "speed"))
    assert (keep_out.at(1.0, 1.5), keep_out.at(4.0, 1.5), keep_out.at(2.5, 2.5)) == (100, 0, 33)
    assert (speed.at(2.5, 1.5), speed.at(1.0, 1.5)) == (100, 0)
