"""Keeps the map of a running mapper, and the drive that it is made of, on the disk, and estimates its error."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import count
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.devices.maps.kept_map import KeptMap, MappedDrive
from chefbot.errors import ChefbotError, ScanError
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import ExplorationStatus
from chefbot.msgs.chefbot_msgs.launches import MapFolder
from chefbot.msgs.chefbot_msgs.maps import MappedScan, MapTrajectory
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Empty, Header, String
from chefbot.runtime.node import Device, In, Out, every, restored, topic
from chefbot.slam.map_error import error_grid
from chefbot.slam.params import GmappingParams
from chefbot.slam.session import Session
from chefbot.storage.mapped_drives import MapperParams, bundle_path, decode_mapper, load_drives

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


class MapRecorderDevice(Device):
    """Writes map and drive into a folder of their own while the robot maps, and at the end.

    So a map outlives the program, a crash and an empty battery, and `chefbot map continue` continues it. The recorder
    runs in the process of the mapper, whose first scan it must not miss; after a restart it adds to what is on the
    disk. With each write it publishes the estimated error of the map as a grid, in cm. On request and after an
    exploration all poses of the map are adjusted jointly first.
    """

    params: MapRecorderParams
    mapped_scan: In[MappedScan]
    map: In[OccupancyGrid]
    map_trajectory: In[MapTrajectory]
    write_now: In[Empty] = topic("map_recorder/write")
    exploration_status: In[ExplorationStatus]
    restored_folder: In[String] = restored("map_recorder/folder")
    folder: Out[String] = topic("map_recorder/folder", latched=True)
    written: Out[MapFolder] = topic("map_recorder/written")
    map_error: Out[OccupancyGrid] = topic(latched=True)
    notice: Out[String] = topic("map_recorder/notice")

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
        self._changed = self._adjusted = False
        """Whether the map differs from that on the disk, and whether the poses of that one are adjusted jointly."""
        self._used = 0
        """Scans of this launch that are part of the map."""
        self._last_notice = ""
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

    def on_write_now(self, _: Empty) -> None:
        """Write the map at once with adjusted poses, then publish its folder, or an empty text where none is kept."""
        self._write_changed(adjusted=True)
        self._writer.submit(self._report_written, self._folder)

    def on_exploration_status(self, status: ExplorationStatus) -> None:
        """Write the map with adjusted poses when an exploration has ended."""
        if status.done:
            self._write_changed(adjusted=True)

    @every(hz=1.0 / WRITE_PERIOD)
    def write(self) -> None:
        """Write the map in a thread, unless one is still being written; raise what went wrong in the thread."""
        finished = self._writing
        if finished is None or finished.done():
            self._write_changed()
            if finished is not None:
                finished.result()

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

    def _write_changed(self, *, adjusted: bool = False) -> None:
        is_newer = self._changed or (adjusted and not self._adjusted)
        if not (is_newer and self._used > 1 and self._grid is not None and self._folder is not None):
            return  # of a robot that has not moved there is nothing to keep
        self._changed, self._adjusted = False, adjusted
        trajectory = self.map_trajectory.last or MapTrajectory()
        content = KeptMap(self._grid, self._mapper, [*self._earlier], [*self._drives], trajectory)
        self._writing = self._writer.submit(self._save, self._folder, content, adjusted)

    # -- in the thread

    def _report_written(self, folder: Path | None) -> None:
        kept = folder is not None and bundle_path(folder).is_file()
        self.post(lambda: self.written.publish(MapFolder(str(folder.absolute()) if folder and kept else "")))

    def _save(self, folder: Path, content: KeptMap, adjusted: bool) -> None:
        try:
            sessions = content.sessions()
            content = content.adjusted(sessions) if adjusted else content
            content.write(folder, sessions)
            self.post(lambda: self._report_kept(str(folder.absolute())))
        except (ChefbotError, OSError, ValueError) as error:
            sentence = f"Warning: the map cannot be kept: {error}"
            self.post(lambda: self._report(sentence))
            return
        try:
            estimate = content.error(sessions)
        except ScanError:
            return  # the robot has hardly moved yet, or scans were lost
        self.post(lambda: self._publish_error(error_grid(estimate)))

    def _publish_error(self, errors: Grid) -> None:
        self.map_error.publish(OccupancyGrid.of(Header.of(self.now_ns, "map"), errors))

    def _report_kept(self, folder: str) -> None:
        self.folder.publish(String(folder))
        self._report(f"The map and its drive are kept in {folder}.")

    def _report(self, sentence: str) -> None:
        """Publish a sentence once, until there is another one."""
        if sentence != self._last_notice:
            self._last_notice = sentence
            self.notice.publish(String(sentence))
