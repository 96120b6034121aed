"""`chefbot map zones`: the zones of a map for other systems, as Nav2's filter masks and as a zone set of VDA 5050."""

from __future__ import annotations

import datetime
import re
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs.maps import MapZones
from chefbot.plural import number_of
from chefbot.storage.atomic_files import make_folder, write_atomic
from chefbot.storage.map_files import load_map, map_in, save_map
from chefbot.storage.zones import load_zones, zones_path
from chefbot.zones.filter_masks import keep_out_mask, speed_mask
from chefbot.zones.vda5050 import zone_set_message

SERIAL_NUMBER = re.compile(r"[A-Za-z0-9_.:-]+")
"""Serial numbers of VDA 5050, which are a level of MQTT topics."""
console = Console(highlight=False, soft_wrap=True, markup=False)


def export_zones(file: Path, out: Path, robot: str) -> None:
    """Write the zones beside a map to a folder. Raises UserError if there are none, or a file is invalid."""
    file = map_in(file)
    path = zones_path(file)
    if not path.is_file():
        raise UserError(f"there is no zones file {path}; draw zones in the web UI, or see docs/zones.md")
    grid = load_map(file)
    if not SERIAL_NUMBER.fullmatch(robot):
        raise UserError(f"the serial number {robot!r} must consist of letters of English, digits and _ . : -")
    loaded = load_zones(path, grid)
    for warning in loaded.warnings:
        console.print(warning)
    zones = MapZones(zones=loaded.zones)
    make_folder(out)
    for name, mask in (("keepout_mask", keep_out_mask(zones, grid)), ("speed_mask", speed_mask(zones, grid))):
        written = save_map(out / name, mask.grid, "raw")
        console.print(f"saved {written}: mask of Nav2, type {mask.type}, multiplier {mask.multiplier:g}")
    _write_zone_set(zones, file.stem, robot, out / "zoneSet.json")


def _write_zone_set(zones: MapZones, map_id: str, robot: str, target: Path) -> None:
    now = datetime.datetime.now(datetime.UTC)
    stamp = now.isoformat(timespec="milliseconds").replace("+00:00", "Z")
    message = zone_set_message(zones.zones, map_id, robot, stamp)
    write_atomic(target, msgspec.json.format(msgspec.json.encode(message), indent=2) + b"\n")
    console.print(f"saved {target}: {number_of(len(zones.zones), 'zone')} of VDA 5050")
