"""CARMEN logs: one reading in a line, as the public 2D laser recordings have them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2

_FURTHEST = 1e6
"""Metres; no log of a robot has coordinates beyond."""
_MOST_BEAMS = 100_000
_AFTER_POSE = 3
"""Words at the end of a line: ipc_timestamp, host, logger_timestamp."""


@dataclass(frozen=True)
class CarmenOdom:
    """An ODOM line: stamp in seconds (ipc_timestamp), the robot by raw odometry."""

    stamp: float
    odom: SE2


@dataclass(frozen=True, eq=False)
class CarmenScan:
    """A FLASER line: stamp in seconds, angles and ranges (n,) float32, laser and robot by raw odometry.

    Beams go counter-clockwise from -90 degrees. Ranges of 0 or less are no measurement.
    """

    stamp: float
    angles: NDArray[np.float32]
    ranges: NDArray[np.float32]
    laser: SE2
    odom: SE2


def parse(log: str | Iterable[str]) -> Iterator[CarmenOdom | CarmenScan]:
    """The FLASER and ODOM readings of a log, a text or its lines, in the order of the lines.

    Stamps may step back; the order of lines is the true one. Other lines are skipped.
    UserError names the first line that cannot be read.
    """
    lines = log.splitlines() if isinstance(log, str) else log
    for number, line in enumerate(lines, 1):
        words = line.split()
        if not words or words[0] not in ("FLASER", "ODOM"):
            continue
        try:
            yield _scan(words) if words[0] == "FLASER" else _odom(words)
        except ValueError as e:
            raise UserError(f"line {number} of the CARMEN log: {e}; cut or repair the line") from e


def _odom(words: list[str]) -> CarmenOdom:
    if len(words) != 7 + _AFTER_POSE:
        raise ValueError(f"ODOM has {len(words)} words instead of 10")
    return CarmenOdom(_number(words[-3]), _pose(words[1:4]))


def _scan(words: list[str]) -> CarmenScan:
    n = int(words[1]) if len(words) > 1 and words[1].isdecimal() and len(words[1]) < 10 else 0
    if not 1 < n <= _MOST_BEAMS:
        raise ValueError(
            f"FLASER is followed by {' '.join(words[1:2]) or 'nothing'} instead of the number of beams"
        )
    if len(words) != n + 8 + _AFTER_POSE:
        raise ValueError(f"FLASER of {n} beams has {len(words)} words instead of {n + 8 + _AFTER_POSE}")
    ranges = np.array([_number(w) for w in words[2 : n + 2]], np.float32)
    laser, odom = _pose(words[n + 2 : n + 5]), _pose(words[n + 5 : n + 8])
    return CarmenScan(_number(words[-3]), beam_angles(n), ranges, laser, odom)


def beam_angles(n: int) -> NDArray[np.float32]:
    """Angles (n,) of a scan's beams: 180 degrees, both ends for an odd number, else without the last."""
    return (-math.pi / 2 + np.arange(n) * (math.pi / (n - n % 2))).astype(np.float32)


def _pose(words: list[str]) -> SE2:
    x, y, yaw = (_number(w) for w in words)
    if max(abs(x), abs(y), abs(yaw)) > _FURTHEST:
        raise ValueError(f"pose {x:g} {y:g} {yaw:g} is absurdly far away")
    return SE2(x, y, yaw)


def _number(word: str) -> float:
    value = float(word)
    if not math.isfinite(value):
        raise ValueError(f"{word} is not a finite number")
    return value
