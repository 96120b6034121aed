"""One drive as a mapper has seen it: what is needed to build its map again, or to continue it."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ScanError
from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import RecordedScan

START_STD_XY, START_STD_YAW = 0.15, 0.05
"""Standard deviations of the pose at which another drive begins, m and rad."""
MAX_VALUES = 200_000_000
"""Maximum number of values of a session's array."""
NO_SCAN = np.empty(0, np.float32)


@dataclass(frozen=True, eq=False)
class Session:
    """The scans of one drive: the odometry of all of them, and the ranges of those that the map consists of.

    stamps: (n,) s. odometry: (n, 3), of the robot. used: (n,) whether a scan is part of the map. beams: (m,) numbers
    of beams of the used ones, whose angles and ranges, rad and m, follow one another. laser: (3,) pose of the laser
    in base_link. range_max: shortest range that means no return, m. start: (3,) pose in the map at the first used
    scan; NaN for a drive that the map frame begins with.
    """

    stamps: NDArray[np.float64]
    odometry: NDArray[np.float64]
    used: NDArray[np.bool_]
    beams: NDArray[np.int32]
    angles: NDArray[np.float32]
    ranges: NDArray[np.float32]
    laser: NDArray[np.float64]
    range_max: float
    start: NDArray[np.float64]

    def __post_init__(self) -> None:
        count, used = len(self.stamps), int(self.used.sum())
        total = int(self.beams.sum())
        shapes = {
            "odometry": (count, 3),
            "used": (count,),
            "beams": (used,),
            "angles": (total,),
            "ranges": (total,),
            "laser": (3,),
            "start": (3,),
        }
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise ScanError(f"the scans of a session do not fit together: {name} has another length")
        if used == 0 or (self.beams < 2).any() or not np.isfinite(self.odometry).all():
            raise ScanError("a session has no scan, or odometry that is not finite")

    @staticmethod
    def of(
        scans: Sequence[RecordedScan], used: Sequence[bool], range_max: float, start: SE2 | None
    ) -> Session:
        """Return the session of a recording; used: which of its scans became part of the map."""
        kept = [scan for scan, is_used in zip(scans, used, strict=True) if is_used]
        return Session(
            np.array([scan.stamp for scan in scans]),
            np.array([scan.odom.array() for scan in scans]),
            np.array(used, bool),
            np.array([len(scan.ranges) for scan in kept], np.int32),
            np.concatenate([scan.angles for scan in kept]).astype(np.float32),
            np.concatenate([scan.ranges for scan in kept]).astype(np.float32),
            scans[0].odom.between(scans[0].laser).array(),
            float(range_max),
            np.full(3, math.nan) if start is None else start.array(),
        )

    def with_used(self, count: int) -> Session:
        """Return the drive with its first `count` used scans, 1 at least, as the only ones of the map."""
        beams = self.beams[:count]
        total = int(beams.sum())
        used = self.used & (np.cumsum(self.used) <= count)
        return replace(self, used=used, beams=beams, angles=self.angles[:total], ranges=self.ranges[:total])

    @property
    def start_pose(self) -> SE2 | None:
        """Pose in the map at the first used scan; None for the origin of the map frame."""
        return None if math.isnan(self.start[0]) else SE2.of(self.start)

    def scans(self) -> Iterator[RecordedScan]:
        """Yield all scans in order; those that are not part of the map have no beams."""
        begin, number = 0, 0
        laser = SE2.of(self.laser)
        for stamp, pose, used in zip(self.stamps.tolist(), self.odometry, self.used.tolist(), strict=True):
            odom, angles, ranges = SE2.of(pose), NO_SCAN, NO_SCAN
            if used:
                end = begin + int(self.beams[number])
                angles, ranges = self.angles[begin:end], self.ranges[begin:end]
                begin, number = end, number + 1
            yield RecordedScan(stamp, angles, ranges, odom @ laser, odom)

    def to_bytes(self) -> bytes:
        """Return the session as an uncompressed archive of arrays (.npz)."""
        file = io.BytesIO()
        arrays: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        np.savez(file, **arrays)
        return file.getvalue()

    @staticmethod
    def from_bytes(data: bytes) -> Session:
        """Return the session of such an archive. Raises ScanError if it is none."""
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as archive:
                arrays = {field.name: archive[field.name] for field in fields(Session)}
        except Exception as error:  # whatever zipfile, zlib and numpy raise for damaged bytes
            raise ScanError(f"a session of a map is damaged ({type(error).__name__})") from None
        arrays = {name: _typed(name, array) for name, array in arrays.items()}
        return Session(**{**arrays, "range_max": float(arrays["range_max"])})


_TYPES = {"used": np.bool_, "beams": np.int32, "angles": np.float32, "ranges": np.float32}


def _typed(name: str, array: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return an array of a session in its type. Raises ScanError for another kind of values, or too many."""
    kind = np.dtype(_TYPES.get(name, np.float64))
    if array.dtype != kind or array.size > MAX_VALUES:
        raise ScanError(f"a session of a map has {array.size} values of {array.dtype} for {name}")
    return array
