"""Parser for CARMEN logs, the format of the public 2D laser data sets: one reading per line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ChefbotError
from chefbot.maths.se2 import SE2

_MAX_COORDINATE = 1e6
"""Limit of plausible coordinates in a log, m."""
_MAX_RANGE = 1e30
"""Limit of ranges in a log, m: far beyond every mark for `no echo`, and a float32."""
_MAX_BEAMS = 100_000
_LINE = re.compile(r"[^\r\n]+(?:\r\n|\r|\n|\Z)|\r\n|\r|\n")
_TRAILING_FIELDS = 3
"""Number of fields at the end of a line: ipc_timestamp, host, logger_timestamp."""


class CarmenLogError(ChefbotError):
    """A CARMEN log with a line that cannot be parsed, or without any scan."""


@dataclass(frozen=True)
class CarmenOdom:
    """An ODOM line: stamp in seconds (ipc_timestamp) and the pose of the robot from raw odometry."""

    stamp: float
    odom: SE2


@dataclass(frozen=True, eq=False)
class CarmenScan:
    """A FLASER line: stamp in seconds, angles and ranges (n,) float32, poses from raw odometry.

    Beams run counter-clockwise from -90 degrees. Ranges of 0 or less are invalid.
    """

    stamp: float
    angles: NDArray[np.float32]
    ranges: NDArray[np.float32]
    laser: SE2
    odom: SE2


def parse(log: str | Iterable[str]) -> Iterator[CarmenOdom | CarmenScan]:
    """Yield the FLASER and ODOM readings of a log, given as a text or as lines, in the order of the lines.

    Stamps may step back; the order of the lines is the true one. Other lines are skipped. Raise CarmenLogError
    with the number of the first line that cannot be parsed.
    """
    lines = _lines(log) if isinstance(log, str) else log
    for number, line in enumerate(lines, 1):
        fields = line.split()
        if not fields or fields[0] not in ("FLASER", "ODOM"):
            continue
        try:
            yield _scan(fields) if fields[0] == "FLASER" else _odom(fields)
        except (ValueError, CarmenLogError) as e:
            raise CarmenLogError(f"line {number} of the CARMEN log: {e}; cut or repair the line") from e


def _lines(text: str) -> Iterator[str]:
    """Yield the lines one at a time: a list of them would need many times the memory of the text."""
    return (line[0] for line in _LINE.finditer(text))


def _odom(fields: list[str]) -> CarmenOdom:
    if len(fields) != 7 + _TRAILING_FIELDS:
        raise CarmenLogError(f"ODOM has {len(fields)} words instead of 10")
    return CarmenOdom(_number(fields[-3]), _pose(fields[1:4]))


def _scan(fields: list[str]) -> CarmenScan:
    n = int(fields[1]) if len(fields) > 1 and fields[1].isdecimal() and len(fields[1]) < 10 else 0
    if not 1 < n <= _MAX_BEAMS:
        raise CarmenLogError(
            f"FLASER is followed by {' '.join(fields[1:2])[:40] or 'nothing'} instead of the number of beams"
        )
    # FLASER n r_1 .. r_n  laser x y yaw  robot x y yaw  stamp host stamp
    if len(fields) != n + 8 + _TRAILING_FIELDS:
        raise CarmenLogError(
            f"FLASER of {n} beams has {len(fields)} words instead of {n + 8 + _TRAILING_FIELDS}"
        )
    ranges = np.array([_number(w) for w in fields[2 : n + 2]])
    if np.abs(ranges).max() > _MAX_RANGE:
        raise CarmenLogError(f"a range of {np.abs(ranges).max():g} m is implausibly long")
    laser, odom = _pose(fields[n + 2 : n + 5]), _pose(fields[n + 5 : n + 8])
    return CarmenScan(_number(fields[-3]), beam_angles(n), ranges.astype(np.float32), laser, odom)


def beam_angles(n: int) -> NDArray[np.float32]:
    """Return the angles (n,) of a scan's beams over 180 degrees.

    Both ends are included for odd n, the last one is left out for even n.
    """
    return (-math.pi / 2 + np.arange(n) * (math.pi / (n - n % 2))).astype(np.float32)


def _pose(fields: list[str]) -> SE2:
    x, y, yaw = (_number(w) for w in fields)
    if max(abs(x), abs(y), abs(yaw)) > _MAX_COORDINATE:
        raise CarmenLogError(f"pose {x:g} {y:g} {yaw:g} is implausibly far away")
    return SE2(x, y, yaw)


def _number(field: str) -> float:
    try:
        value = float(field)
    except ValueError:
        raise CarmenLogError(f"{field[:40]!r} is not a number") from None
    if not math.isfinite(value):
        raise CarmenLogError(f"{field[:40]} is not a finite number")
    return value
