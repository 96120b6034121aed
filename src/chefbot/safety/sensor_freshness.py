"""Whether an obstacle sensor shows what is there now: without that no twist is commanded.

Data count when they are young by their stamp, when they are not the same again and again, and when a large part
of the field of view says something. The limits are three periods of the sensor (compare nav2_collision_monitor's
`source_timeout`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

PERIODS = 3
"""Data older than so many periods of their sensor are too old."""
LEAST_LIMIT_NS = 200_000_000
"""Of a fast sensor, which may need more than three of its periods from exposure to delivery."""
AHEAD_NS = 100_000_000
"""A stamp so far ahead of the clock still counts: two computers' clocks, or a process that lags behind another."""
GOOD_AGAIN = 5
"""Messages in a row without a fault before the data count again."""
MOVED, TURNED = 0.02, 0.03
"""Metres and radians of motion after which data must differ, even of a sensor without noise."""
STOOD, STOOD_YAW = 0.0005, 0.0005
"""Metres and radians; a robot that moved less between two messages stood."""
NOISE, NOISY_SHARE, NOISY_MESSAGES = 0.0002, 0.5, 5
"""A sensor is noisy when this share of what it measures differs by so many metres from message to message, so many
times in a row, while the robot stands: people who walk by change less, and a robot that settles does so once."""
FEWEST = 10
"""Fewer measured directions say nothing about noise."""
MUTE_SHARE = 0.5
"""A quarter of the field of view with more than this share of directions without data is blind."""


class View(NamedTuple):
    """One message of a sensor: what it says along each of n directions, in order of angle.

    stamp_ns: when it was measured. data: (n, k) all that was measured, metres. met: (n,) where an obstacle was met.
    measured: (n,) where that or the floor was. mute: (n,) where neither these nor free space was seen. near: whether
    an obstacle well within the range was met.
    """

    stamp_ns: int
    data: NDArray[np.float32]
    met: NDArray[np.bool_]
    measured: NDArray[np.bool_]
    mute: NDArray[np.bool_]
    near: bool


class SensorWatch:
    """Judges one sensor by its messages, the clock and the odometry.

    title: as people call it, such as "lidar". period: seconds between two messages by the robot file.
    """

    def __init__(self, title: str, period: float) -> None:
        self.title = title
        self.limit_ns = max(round(PERIODS * period * 1e9), LEAST_LIMIT_NS)
        self._last: View | None = None
        self._came_ns = self._changed_ns = self._placed_ns = 0
        self._pose: SE2 | None = None
        self._changed_at: SE2 | None = None
        self._noisy = self._was_near = False
        self._restless = 0
        self._good = 0
        self._fault = f"The {title} has not sent anything yet."

    def see(self, view: View, now_ns: int, pose: SE2 | None) -> None:
        """Take in a message; `pose`: of the robot in the odometry's frame, None where that is not known."""
        last = self._last
        self._learn(view, pose)
        if last is None or not np.array_equal(view.data, last.data, equal_nan=True):
            self._changed_ns, self._changed_at = view.stamp_ns, pose
        if last is None:
            self._placed_ns = view.stamp_ns  # the transforms have as long as every message has
        elif view.stamp_ns - last.stamp_ns > self.limit_ns:
            self._complain(f"The {self.title} sends too seldom: two messages lay {self._limit} apart.")
        self._was_near = view.near or (self._was_near and not view.met.any())
        self._last, self._pose, self._came_ns = view, pose, now_ns
        self._good += 1

    def place(self, stamp_ns: int) -> None:
        """The data of that time have found their place in the costmap."""
        self._placed_ns = stamp_ns

    def fault(self, now_ns: int, pose: SE2 | None) -> str:
        """Why no twist may be commanded now, a sentence; empty while the data are good."""
        fault = self._find_fault(now_ns, pose)
        if fault:
            self._complain(fault)
        return self._fault if self._good < GOOD_AGAIN else ""

    def blind(self, known: NDArray[np.bool_] | None = None) -> bool:
        """Whether the newest message shows nothing in a quarter of the field of view or more.

        known: (n,) directions in which it is known why they show nothing; these do not count.
        """
        if self._last is None:
            return False
        quarters = np.array_split(self._last.mute if known is None else self._last.mute & ~known, 4)
        return any(float(part.mean()) > MUTE_SHARE for part in quarters if len(part)) or self._lost_all

    @property
    def _lost_all(self) -> bool:
        """Whether surfaces that were near a message ago are gone on all sides: no room empties at once."""
        return self._last is not None and self._was_near and not self._last.met.any()

    @property
    def _limit(self) -> str:
        return f"more than {self.limit_ns / 1e9:.1f} s"

    def _complain(self, fault: str) -> None:
        self._fault, self._good = fault, 0

    def _find_fault(self, now_ns: int, pose: SE2 | None) -> str:
        last, limit = self._last, self.limit_ns
        if last is None:
            return f"The {self.title} has not sent anything yet."
        if now_ns - self._came_ns > limit:
            return f"The {self.title} has sent nothing for {self._limit}."
        if last.stamp_ns - now_ns > AHEAD_NS:
            return f"The {self.title}'s data are stamped in the future: compare its computer's clock with this one's."
        if now_ns - last.stamp_ns > limit:
            return f"The {self.title}'s data come late: they are {self._limit} old."
        if now_ns - self._changed_ns > limit and self._should_differ(pose):
            return f"The {self.title} is frozen: it sends the same data again and again."
        if now_ns - self._placed_ns > limit:
            return f"The {self.title}'s data cannot be placed: no transform leads from their frame to odom."
        return ""

    def _learn(self, view: View, pose: SE2 | None) -> None:
        """A sensor whose data differ while the robot stands has noise: from then on equal data are frozen ones."""
        known = pose is not None and self._pose is not None
        stood = known and not _apart(pose, self._pose, STOOD, STOOD_YAW)
        self._restless = self._restless + 1 if stood and self._differs(view) else 0
        self._noisy = self._noisy or self._restless >= NOISY_MESSAGES

    def _differs(self, view: View) -> bool:
        last = self._last
        if last is None or view.data.shape != last.data.shape:
            return False
        both = view.measured & last.measured
        if int(both.sum()) < FEWEST:
            return False
        with np.errstate(invalid="ignore"):
            differs = (np.abs(view.data[both] - last.data[both]) > NOISE).any(axis=1)
        return float(differs.mean()) > NOISY_SHARE

    def _should_differ(self, pose: SE2 | None) -> bool:
        """Whether equal data are a fault; where nothing is measured there is nothing that could differ.

        Bare floor looks the same from everywhere to a camera without noise.
        """
        assert self._last is not None
        known = pose is not None and self._changed_at is not None
        moved = known and _apart(pose, self._changed_at, MOVED, TURNED)
        return (self._noisy and bool(self._last.measured.any())) or (moved and bool(self._last.met.any()))


def _apart(a: SE2 | None, b: SE2 | None, distance: float, angle: float) -> bool:
    assert a is not None and b is not None
    return a.distance(b) > distance or abs(wrap(a.yaw - b.yaw)) > angle
