"""Parser for CARMEN logs, the format of the public 2D laser data sets: one reading per line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ChefbotError
from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import NO_RETURN, RecordedOdometry, RecordedScan

_MAX_COORDINATE = 1e6
"""Limit of plausible coordinates in a log, m."""
_MAX_RANGE = 1e30
"""Limit of ranges in a log, m: far beyond every mark for `no echo`, and a float32."""
_MAX_BEAMS = 100_000
_LINE = re.compile(r"[^\r\n]+(?:\r\n|\r|\n|\Z)|\r\n|\r|\n")
_TRAILING_FIELDS = 3
"""Number of fields at the end of a line: ipc_timestamp, host, logger_timestamp."""


_SCANS = ("FLASER", "ROBOTLASER1")
_FIELD_OF_VIEW, _MAX_RANGE_NAME = "laser_front_laser_fov", "robot_front_laser_max"
"""Parameters of the front laser, in degrees and m."""


class CarmenLogError(ChefbotError):
    """A CARMEN log with a line that cannot be parsed, or without any scan."""


def parse(log: str | Iterable[str]) -> Iterator[RecordedOdometry | RecordedScan]:
    """Yield the laser and ODOM readings of a log, given as a text or as lines, in the order of the lines.

    Scans are FLASER or ROBOTLASER1 lines, whichever kind is first: a logger may write both for each scan. Field of
    view and maximum range of FLASER are those of PARAM lines. Stamps may step back; the order of the lines is the
    true one. Other lines are skipped. Raise CarmenLogError with the number of the first line that cannot be parsed.
    """
    lines = _lines(log) if isinstance(log, str) else log
    laser = _FrontLaser()
    for number, line in enumerate(lines, 1):
        fields = line.split()
        if not fields or fields[0] not in (*_SCANS, "ODOM", "PARAM"):
            continue
        try:
            if fields[0] == "PARAM":
                laser.configure(fields[1:3])
            elif fields[0] == "ODOM":
                yield _odom(fields)
            elif laser.is_used(fields[0]):
                yield laser.scan(fields) if fields[0] == "FLASER" else _robot_laser(fields)
        except (ValueError, CarmenLogError) as e:
            raise CarmenLogError(f"line {number} of the CARMEN log: {e}; cut or repair the line") from e


def without_cut_line(text: str) -> tuple[str, str]:
    """Return a log without a last line that was cut off, as by a crash of the logger, and a sentence about that.

    The sentence is empty for a complete log.
    """
    last = text[max(text.rfind("\n"), text.rfind("\r")) + 1 :]
    try:
        for _ in parse([last]):
            pass
    except CarmenLogError:
        return text[: len(text) - len(last)], "The last line of the log is cut off; it is left out."
    return text, ""


def _lines(text: str) -> Iterator[str]:
    """Yield the lines one at a time: a list of them would need many times the memory of the text."""
    return (line[0] for line in _LINE.finditer(text))


def _odom(fields: list[str]) -> RecordedOdometry:
    if len(fields) != 7 + _TRAILING_FIELDS:
        raise CarmenLogError(f"ODOM has {len(fields)} words instead of 10")
    return RecordedOdometry(_number(fields[-3]), _pose(fields[1:4]))


class _FrontLaser:
    """The laser of the FLASER lines, as PARAM lines describe it."""

    def __init__(self) -> None:
        self._used = ""
        self._field_of_view, self._max_range = math.pi, math.inf

    def is_used(self, kind: str) -> bool:
        """Return whether scans of a kind of line are used: those of the first kind are."""
        self._used = self._used or kind
        return kind == self._used

    def configure(self, fields: list[str]) -> None:
        """Take over a parameter, as (name, value). CarmenLogError for a value that no laser has."""
        if len(fields) < 2 or fields[0] not in (_FIELD_OF_VIEW, _MAX_RANGE_NAME):
            return
        value = _number(fields[1])
        limit = 360.0 if fields[0] == _FIELD_OF_VIEW else _MAX_RANGE
        if not 0.0 < value <= limit:
            raise CarmenLogError(f"{fields[0]} of {value:g} is not that of a laser")
        if fields[0] == _FIELD_OF_VIEW:
            self._field_of_view = math.radians(value)
        else:
            self._max_range = value

    def scan(self, fields: list[str]) -> RecordedScan:
        """Return the scan of FLASER n r_1 .. r_n, laser x y yaw, robot x y yaw, stamp host stamp."""
        n = _count("FLASER", "beams", fields[1:2])
        _check_length("FLASER", n, fields, n + 8 + _TRAILING_FIELDS)
        ranges = _ranges(fields[2 : n + 2], self._max_range)
        laser, odom = _pose(fields[n + 2 : n + 5]), _pose(fields[n + 5 : n + 8])
        return RecordedScan(_number(fields[-3]), beam_angles(n, self._field_of_view), ranges, laser, odom)


def _robot_laser(fields: list[str]) -> RecordedScan:
    """Return the scan of a ROBOTLASER1 line.

    ROBOTLASER1 type start fov resolution max_range accuracy mode n r_1 .. r_n m i_1 .. i_m, laser x y yaw, robot x y
    yaw, 5 other numbers, stamp host stamp; angles in rad (CARMEN's laser_messages.h).
    """
    n = _count("ROBOTLASER1", "beams", fields[8:9])
    start, field_of_view, resolution, max_range = (_number(w) for w in fields[2:6])
    m = _count("ROBOTLASER1", "intensities", fields[n + 9 : n + 10], minimum=0)
    _check_length("ROBOTLASER1", n, fields, n + m + 21 + _TRAILING_FIELDS)
    step = resolution or field_of_view / (n - 1)
    if not 0.0 < step * (n - 1) < 2.0 * math.pi + step:
        raise CarmenLogError(f"{n} beams of {math.degrees(step):g} degrees each are not those of a laser")
    first = n + m + 10
    angles = (start + step * np.arange(n)).astype(np.float32)
    laser, odom = _pose(fields[first : first + 3]), _pose(fields[first + 3 : first + 6])
    ranges = _ranges(fields[9 : n + 9], max_range if max_range > 0.0 else math.inf)
    return RecordedScan(_number(fields[-3]), angles, ranges, laser, odom)


def _count(kind: str, what: str, fields: list[str], minimum: int = 2) -> int:
    """Return the number of beams or intensities that a line announces."""
    text = fields[0] if fields else ""
    count = int(text) if text.isdecimal() and len(text) < 10 else -1
    if not minimum <= count <= _MAX_BEAMS:
        raise CarmenLogError(f"{kind} has {text[:40] or 'nothing'} instead of the number of {what}")
    return count


def _check_length(kind: str, n: int, fields: list[str], expected: int) -> None:
    if len(fields) != expected:
        raise CarmenLogError(f"{kind} of {n} beams has {len(fields)} words instead of {expected}")


def _ranges(fields: list[str], max_range: float) -> NDArray[np.float32]:
    """Return the ranges, m; those from the maximum range on are no returns, `nan` is an invalid one (REP-117)."""
    ranges = np.nan_to_num([_float(w) for w in fields], nan=0.0, posinf=NO_RETURN, neginf=-NO_RETURN)
    if np.abs(ranges).max() > _MAX_RANGE:
        raise CarmenLogError(f"a range of {np.abs(ranges).max():g} m is implausibly long")
    return np.where(ranges >= max_range, NO_RETURN, ranges).astype(np.float32)


def beam_angles(n: int, field_of_view: float = math.pi) -> NDArray[np.float32]:
    """Return the angles (n,) of a scan's beams over a field of view, rad.

    Both ends are included for odd n, the last one is left out for even n.
    """
    return (-field_of_view / 2 + np.arange(n) * (field_of_view / (n - n % 2))).astype(np.float32)


def _pose(fields: list[str]) -> SE2:
    x, y, yaw = (_number(w) for w in fields)
    if max(abs(x), abs(y), abs(yaw)) > _MAX_COORDINATE:
        raise CarmenLogError(f"pose {x:g} {y:g} {yaw:g} is implausibly far away")
    return SE2(x, y, yaw)


def _float(field: str) -> float:
    try:
        return float(field)
    except ValueError:
        raise CarmenLogError(f"{field[:40]!r} is not a number") from None


def _number(field: str) -> float:
    value = _float(field)
    if not math.isfinite(value):
        raise CarmenLogError(f"{field[:40]} is not a finite number")
    return value
