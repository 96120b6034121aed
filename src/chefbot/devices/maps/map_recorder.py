"""Keeps the map of a running mapper, and the drive that it is made of, on the disk."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import count
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.errors import ChefbotError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_maps import MappedScan
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Device, In, Out, every, restored, topic
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session
from chefbot.storage.atomic_files import make_folder
from chefbot.storage.mapped_drives import MapperParams, decode_mapper, files_beside_map, load_drives
from chefbot.storage.new_map import save_new_map

MAX_BEAMS_KEPT = 30_000_000
"""Number of beams that are kept in memory, 8 bytes each: some 80,000 scans of a lidar."""
WRITE_PERIOD = 20.0
"""Time between two writes of a map that has changed, s."""


class MapRecorderParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the map recorder."""

    folder: Annotated[
        str,
        Meta(
            min_length=1, description="folder in which each map gets a folder of its own, named by its time"
        ),
    ] = "runs/maps"
    continue_map: Annotated[
        str, Meta(description="map bundle, or its folder, that the mapper continues; it stays as it is")
    ] = ""


class MappedDrive:
    """One drive of a map, as far as it has been driven."""

    def __init__(self, first: MappedScan) -> None:
        self._first, self._scans = first, list[tuple[RecordedScan, bool]]()

    def add(self, message: MappedScan) -> None:
        """Add the next scan of the drive."""
        odom = SE2.of(message.odometry)
        stamp, laser = message.header.stamp.ns * 1e-9, odom @ SE2.of(message.laser)
        scan = RecordedScan(stamp, message.angles, message.ranges, laser, odom)
        self._scans.append((scan, message.used))

    def session(self) -> Session:
        """Return the drive up to now; scans may be added meanwhile. Raises ScanError if odometry is not finite."""
        scans, used = zip(*self._scans.copy(), strict=True)
        return Session.of(scans, used, self._first.range_max, SE2.of(self._first.start))


class KeptMap(NamedTuple):
    """What is written: the map, its mapper, and the drives that it is made of."""

    grid: Grid
    mapper: MapperParams
    earlier: list[Session]
    drives: list[MappedDrive]


class MapRecorderDevice(Device):
    """Writes map and drive into a folder of their own while the robot maps, and at the end.

    So a map outlives the program, a crash and an empty battery, and `chefbot map continue` continues it. The recorder
    runs in the process of the mapper, whose first scan it must not miss; after a restart it adds to what is on the
    disk.
    """

    params: MapRecorderParams
    mapped_scan: In[MappedScan]
    map: In[OccupancyGrid]
    restored_folder: In[String] = restored("map_recorder/folder")
    folder: Out[String] = topic("map_recorder/folder", latched=True)
    remark: Out[String] = topic("map_recorder/remark")

    def start(self) -> None:
        """Wait for the first scan of a map. Raises UserError if the bundle of a continued one cannot be read."""
        self._drives: list[MappedDrive] = []
        self._earlier: Sequence[Session] = ()
        self._mapper: MapperParams = GmappingParams()
        self._beams = 0
        if self.params.continue_map:
            self._load(Path(self.params.continue_map))
        self._folder: Path | None = None
        self._folders: set[Path] = set()
        self._grid: Grid | None = None
        self._changed = False
        self._used = 0
        """Scans of this launch that are part of the map."""
        self._last_remark = ""
        self._writer = ThreadPoolExecutor(1, "map recorder")
        self._writing: Future[None] | None = None

    def stop(self) -> None:
        """Write what has changed since."""
        super().stop()
        self._write_changed()
        self._writer.shutdown()

    def on_mapped_scan(self, message: MappedScan) -> None:
        """Add a scan to the drive; the first of a map begins a folder, one after a restart another drive."""
        if message.number == 0:
            self._begin_drive(message)
        if not self._drives:
            self._report(
                "Warning: the map recorder has missed the beginning of the map; it does not keep it."
            )
            return
        self._beams += len(message.ranges)
        if self._beams > MAX_BEAMS_KEPT:
            self._report(
                "Warning: the drive is too long to be kept; the map can be continued up to here only."
            )
            return
        self._drives[-1].add(message)
        self._used += message.used

    def on_restored_folder(self, message: String) -> None:
        """Continue the map of before a restart, in its folder; one that cannot be read is left as it is."""
        self._load(Path(message.data))
        self._folder = Path(message.data)

    def on_map(self, message: OccupancyGrid) -> None:
        """Remember the newest map, which follows the scans that it is made of."""
        self._grid, self._changed = message.grid, True

    @every(hz=1.0 / WRITE_PERIOD)
    def write(self) -> None:
        """Write the map in a thread, unless one is still being written."""
        if self._writing is None or self._writing.done():
            self._write_changed()

    def _load(self, path: Path) -> None:
        drives = load_drives(path)
        self._earlier, self._mapper = drives.sessions, drives.params

    def _begin_drive(self, message: MappedScan) -> None:
        if not message.continued:
            self._write_changed()  # the map before, which was reset
            self._changed = False
            self._drives, self._beams, self._grid, self._used = [], 0, None, 0
            self._mapper = decode_mapper(message.mapper.encode())
            self._earlier, self._folder = (), self._new_folder()
        elif not (self._drives or self._earlier):
            return
        if self._folder is None:
            self._folder = self._new_folder()
        self._drives.append(MappedDrive(message))

    def _new_folder(self) -> Path:
        """Return a folder named by the time, which neither exists yet nor will be written to."""
        stem = Path(self.params.folder) / time.strftime("%Y%m%d_%H%M%S", time.gmtime())
        names = (stem if i == 1 else stem.with_name(f"{stem.name}_{i}") for i in count(1))
        folder = next(name for name in names if name not in self._folders and not name.exists())
        self._folders.add(folder)
        return folder

    def _write_changed(self) -> None:
        if not (self._changed and self._used > 1 and self._grid is not None and self._folder is not None):
            return  # of a robot that has not moved there is nothing to keep
        self._changed = False
        content = KeptMap(self._grid, self._mapper, [*self._earlier], [*self._drives])
        self._writing = self._writer.submit(self._save, self._folder, content)

    # -- in the thread

    def _save(self, folder: Path, content: KeptMap) -> None:
        try:
            _write_files(folder, content)
            self.post(lambda: self._report_kept(str(folder.absolute())))
        except (ChefbotError, OSError, ValueError) as error:
            sentence = f"Warning: the map cannot be kept: {error}"
            self.post(lambda: self._report(sentence))

    def _report_kept(self, folder: str) -> None:
        self.folder.publish(String(folder))
        self._report(f"The map and its drive are kept in {folder}.")

    def _report(self, sentence: str) -> None:
        """Publish a sentence once, until there is another one."""
        if sentence != self._last_remark:
            self._last_remark = sentence
            self.remark.publish(String(sentence))


def _write_files(folder: Path, content: KeptMap) -> None:
    """Write map, picture and bundle, whole or not at all."""
    grid, sessions = content.grid, [*content.earlier, *(drive.session() for drive in content.drives)]
    make_folder(folder)
    companions = files_beside_map(content.mapper, sessions, grid)
    save_new_map(folder / "map", grid, [(folder / name, data) for name, data in companions.items()])
