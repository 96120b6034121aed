"""Persistence of a built robot's last pose on its map: after a restart, localization tries it first."""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.devices.initial_pose import InitialPoseDevice, InitialPoseParams
from chefbot.devices.state_files import StateFileParams, read_state, state_folder, store_state
from chefbot.maths.angles import wrap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import In, Out, topic
from chefbot.storage.atomic_files import StorageError

STORED_STEP, STORED_TURN = 0.25, 0.26
"""Distance, m, and angle, rad, from the stored pose at which another one is stored: half of an initial pose's
standard deviations."""
BROKEN = "{}: {}; localization starts without the last pose."


class PoseFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Content of the file: a pose, m and rad, in the frame of the map with this SHA-256."""

    map: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    x: Annotated[float, Meta(ge=-1e7, le=1e7)]
    y: Annotated[float, Meta(ge=-1e7, le=1e7)]
    yaw: Annotated[float, Meta(ge=-7, le=7)]

    @property
    def pose(self) -> SE2:
        """The pose on the map."""
        return SE2(self.x, self.y, self.yaw)


class StoredPoseParams(InitialPoseParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the initial pose; three zeros mean that none is given."""

    namespace: Annotated[str, Meta(description="the robot's; empty where there is none")] = ""
    assume_origin: Annotated[
        bool, Meta(description="whether without a given and a stored pose the robot is at the map's origin")
    ] = False


class StoredPoseDevice(InitialPoseDevice):
    """Publishes the pose at which the robot was when it was last localized on this map, and stores each new one.

    A given pose comes before the stored one. Where there is neither, localization is global, or the robot is assumed
    at the map's origin, where mapping began. A robot that was carried while it was off recovers as from any wrong
    initial pose.
    """

    params: StoredPoseParams
    map: In[OccupancyGrid]
    localization_status: In[LocalizationStatus]
    notice: Out[String] = topic("stored_pose/notice")

    def start(self) -> None:
        """Read the file, and wait for the map; a damaged file is one sentence in the terminal."""
        self._pose, self._checked = None, False
        files = StateFileParams(namespace=self.params.namespace)
        self._path = pose_path(files.file_name(self.robot.name))
        self._stored: PoseFile | None = None
        self._map, self._started, self._last_notice = "", False, ""
        self._disk = ThreadPoolExecutor(1, "stored pose")
        try:
            self._stored = read_state(self._path, PoseFile)
        except (OSError, msgspec.MsgspecError, ValueError) as error:
            self._report(BROKEN.format(self._path, error))

    def stop(self) -> None:
        """Finish what is being written."""
        super().stop()
        self._disk.shutdown()

    def on_map(self, message: OccupancyGrid) -> None:
        """Publish the initial pose with the first map; poses are stored for the newest one."""
        self._map = map_identity(message.grid)
        pose = None if self._started else self._likely_pose()
        self._started = True
        if pose is not None:
            self.assume(pose)

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Store the pose of a localized robot that has moved."""
        estimate = self.amcl_pose.last
        if not self._map or not status.localized or estimate is None:
            return
        pose, stored = estimate.pose.pose.se2, self._stored
        if stored is not None and stored.map == self._map and _is_near(pose, stored.pose):
            return
        self._stored = PoseFile(map=self._map, x=pose.x, y=pose.y, yaw=pose.yaw)
        self._disk.submit(self._write, self._stored)

    def _likely_pose(self) -> SE2 | None:
        if self.pose() != IDENTITY:
            return self.pose()
        if self._stored is not None and self._stored.map == self._map:
            return self._stored.pose
        return IDENTITY if self.params.assume_origin else None

    def _write(self, pose: PoseFile) -> None:
        """Write a pose, in the thread; a full disk is reported once and costs only the pose."""
        try:
            store_state(self._path, pose)
        except StorageError as error:
            self._report(f"Warning: the robot's pose cannot be kept: {error}")

    def _report(self, sentence: str) -> None:
        if sentence != self._last_notice:
            self._last_notice = sentence
            self.post(partial(self.notice.publish, String(sentence)))


def pose_path(robot: str) -> Path:
    """Return the file of a robot's last pose, by the name of its state files."""
    return state_folder() / f"{robot}.pose.json"


def map_identity(grid: Grid) -> str:
    """Return the SHA-256 of a map: its cells, resolution and origin."""
    header = f"{grid.cells.shape} {grid.resolution:.9g} {grid.origin_x:.9g} {grid.origin_y:.9g} "
    return hashlib.sha256(header.encode() + grid.cells.tobytes()).hexdigest()


def _is_near(pose: SE2, stored: SE2) -> bool:
    return pose.distance(stored) < STORED_STEP and abs(wrap(pose.yaw - stored.yaw)) < STORED_TURN
