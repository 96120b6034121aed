"""Checks of `chefbot doctor`: web UI, browser, disk, maps, cameras, clock and power supply of this computer.

Each returns lines; one that begins with "! " is a problem.
"""

from __future__ import annotations

import http.client
import os
import shutil
import subprocess
import urllib.error
import urllib.request
from datetime import datetime
from pathlib import Path

import chefbot
from chefbot.cli.parameters import WEB_UI
from chefbot.devices.state_files import VARIABLE, maps_folder, state_folder
from chefbot.errors import ChefbotError
from chefbot.plural import number_of
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_places, places_path
from chefbot.storage.zones import load_zones, zones_path
from chefbot.ui.access.addresses import PORTS_TO_TRY
from chefbot.ui.browser import has_screen

TIMEOUT = 1.0
"""Maximum time in which a web UI of this computer or a program responds, s."""
MIN_FREE_BYTES = 1_000_000_000
"""Free space below which logs and maps may not fit, bytes."""
SHOWN_MAPS = 5
"""Number of maps that are listed, the newest."""
CAMERAS = Path("/sys/class/video4linux")
VOLTAGE_SENSORS = Path("/sys/class/hwmon")
MAP_PATTERNS = ("*.yaml", "runs/*/*.yaml", "maps/*.yaml")
"""Where maps are looked for, from the working directory."""


def web_ui_lines(address: str = WEB_UI, ports: int = PORTS_TO_TRY) -> list[str]:
    """Return where robots serve their web UIs, and how a browser gets there: at this address, or a port after it.

    ports: number of ports, of which a launch takes the first free one.
    """
    look = "" if has_screen() else "; there is no screen here: with --lan other devices can open it"
    host, _, port = address.rpartition(":")
    served = {url: _is_web_ui(url) for url in (f"{host}:{int(port) + step}" for step in range(ports))}
    if any(served.values()):
        return [f"web UI: {url}{look}" for url, found in served.items() if found]
    if served[address] is None:
        return [f"web UI: none is served at {address}{look}"]
    return [f"! web UI: another program uses port {port}; a launch takes the next free one, or port:=8090"]


def _is_web_ui(address: str) -> bool | None:
    """Return whether the server at an address is a robot's web UI; None if there is no server."""
    try:
        page = _first_page(address)
    except ConnectionRefusedError:
        return None
    except (OSError, http.client.HTTPException):
        return False
    return b"<title>Chefbot</title>" in page or b"token that chefbot printed" in page


def _first_page(address: str) -> bytes:
    """Return the begin of what a server answers, also of a refusal; OSError or HTTPException without an answer."""
    try:
        with urllib.request.urlopen(address, timeout=TIMEOUT) as answer:
            return bytes(answer.read(10_000))
    except urllib.error.HTTPError as refusal:
        return refusal.read(10_000)
    except urllib.error.URLError as error:
        raise error.reason if isinstance(error.reason, OSError) else error from None


def disk_lines() -> list[str]:
    """Return the free space where logs and maps are written, and whether the robot's state can be kept."""
    folder = state_folder()
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    lines = [_space(Path.cwd(), "here")]
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        lines.append(f"! {folder}, where the state of robots is kept ({VARIABLE}), cannot be written")
    elif existing.stat().st_dev != Path.cwd().stat().st_dev:
        lines.append(_space(existing, f"for the state in {folder}"))
    return lines


def _space(folder: Path, where: str) -> str:
    free = shutil.disk_usage(folder).free
    problem = "! " if free < MIN_FREE_BYTES else ""
    return f"{problem}disk: {free / 1e9:.1f} GB free {where}"


def map_lines(folder: Path) -> list[str]:
    """Return the newest maps below a folder, and of those saved in the web UI, with their sizes and places."""
    found = [
        *(path for pattern in MAP_PATTERNS for path in folder.glob(pattern)),
        *maps_folder().glob("*.yaml"),
    ]
    described = [path for path in dict.fromkeys(found) if _is_map(path)]
    newest = sorted(described, key=lambda path: path.stat().st_mtime, reverse=True)
    if not newest:
        return ["maps: none here; make one: chefbot demo"]
    more = f" (and {len(newest) - SHOWN_MAPS} older)" if len(newest) > SHOWN_MAPS else ""
    return [f"maps{more}:", *(_map_line(path, folder) for path in newest[:SHOWN_MAPS])]


def _is_map(path: Path) -> bool:
    """Return whether a YAML file describes a map of the ROS map server, or did before it was damaged."""
    if any(path.with_suffix(end).exists() for end in (".pgm", ".png")):
        return True
    try:
        with path.open("rb") as file:
            text = file.read(2000)
    except OSError:
        return False
    return b"image:" in text and b"resolution:" in text


def _map_line(path: Path, folder: Path) -> str:
    name = path.relative_to(folder) if path.is_relative_to(folder) else path
    try:
        grid = load_map(path)
        places = load_places(places_path(path)) if places_path(path).exists() else {}
        if zones_path(path).exists():
            load_zones(zones_path(path), grid, places)
    except ChefbotError as error:
        return f"! {name}: {error}"
    rows, columns = grid.cells.shape
    size = f"{columns * grid.resolution:.0f} x {rows * grid.resolution:.0f} m"
    named = (
        number_of(len(places), "place") if places else "no named places, so nothing can be delivered on it"
    )
    return f"  {name}: {size}, {named}"


def camera_lines(folder: Path = CAMERAS) -> list[str]:
    """Return the cameras that the system knows (Linux), and those that may not be opened."""
    lines = [_camera_line(device) for device in sorted(folder.glob("video*"))]
    return ["cameras:", *lines] if lines else ["cameras: none is plugged in"]


def _camera_line(device: Path) -> str:
    path = Path("/dev") / device.name
    try:
        name = (device / "name").read_text().strip()
    except OSError:
        name = "without a name"
    if path.exists() and not os.access(path, os.R_OK | os.W_OK):
        return f"! {path}: {name}; it may not be opened: sudo usermod -aG video $USER, then log out and in"
    return f"  {path}: {name}"


def clock_lines() -> list[str]:
    """Return problems of the clock: before this program was installed, or not synchronized."""
    installed, now = datetime.fromtimestamp(Path(chefbot.__file__).stat().st_mtime), datetime.now()
    if now < installed:
        return [f"! clock: it shows {now:%Y-%m-%d}, before chefbot was installed; certificates need it right"]
    if _is_synchronized() is False:
        return ["! clock: it is not synchronized; messages between machines are late or from the future"]
    return []


def _is_synchronized() -> bool | None:
    """Return what systemd knows of the clock; None without it."""
    try:
        answer = subprocess.run(
            ["timedatectl", "show", "--property=NTPSynchronized", "--value"],
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return {"yes": True, "no": False}.get(answer.stdout.strip())


def power_lines(folder: Path = VOLTAGE_SENSORS) -> list[str]:
    """Return whether a Raspberry Pi has had too little voltage since its start."""
    for sensor in folder.glob("hwmon*"):
        alarm = sensor / "in0_lcrit_alarm"
        try:
            if (sensor / "name").read_text().strip() == "rpi_volt" and alarm.read_text().strip() == "1":
                return ["! power supply: the voltage of this Raspberry Pi was too low; use a stronger one"]
        except OSError:
            continue
    return []
