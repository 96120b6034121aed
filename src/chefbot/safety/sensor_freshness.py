"""Detects stale, frozen and blind obstacle sensors; without valid data no twist is commanded.

Data are valid if their stamp is recent, if they change, and if a large part of the field of view has data. The
timeouts are three periods of the sensor (compare nav2_collision_monitor's `source_timeout`).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

MAX_AGE_PERIODS = 3
"""Maximum age of data in periods of their sensor."""
MIN_MAX_AGE_NS = 200_000_000
"""Minimum of that maximum age, ns: a fast sensor may take more than three periods from exposure to delivery."""
CLOCK_TOLERANCE_NS = 100_000_000
"""Tolerance of stamps in the future, ns: clocks of two computers, or a process that lags behind another."""
VALID_MESSAGES_REQUIRED = 5
"""Consecutive messages without a fault before the data are valid again."""
MOVED_DISTANCE, MOVED_ANGLE = 0.02, 0.03
"""Motion, m and rad, after which data must differ, even of a sensor without noise."""
STANDSTILL_DISTANCE, STANDSTILL_ANGLE = 0.0005, 0.0005
"""Motion between two messages, m and rad, below which the robot counts as standing still."""
NOISE_THRESHOLD, NOISY_FRACTION, NOISY_MESSAGES = 0.0002, 0.5, 5
"""A sensor is noisy if this fraction of its directions differs by more than the threshold (m) between messages, so
many times in a row, at standstill: people walking by change less, and a robot that comes to rest does so once."""
MIN_NOISE_DIRECTIONS = 10
"""Minimum number of measured directions for the detection of noise."""
BLIND_FRACTION = 0.5
"""Fraction of directions without data above which a quarter of the field of view is blind."""
EDGE_FRACTION = 1.0 / 16.0
"""Fraction of the field of view without data from one of its edges on, beyond what there ever was, above which
something has come in from the side that is too near to be seen."""


class SensorView(NamedTuple):
    """One message of a sensor along n directions, in order of angle.

    stamp_ns: time of measurement. data: (n, k) all measurements, m. met: (n,) whether an obstacle was hit.
    measured: (n,) whether an obstacle or the floor was hit. mute: (n,) whether there is no data, not even free space.
    near: whether an obstacle well within the range was hit. frame: in which the sensor measures.
    """

    stamp_ns: int
    data: NDArray[np.float32]
    met: NDArray[np.bool_]
    measured: NDArray[np.bool_]
    mute: NDArray[np.bool_]
    near: bool
    frame: str


class ObstacleSensorMonitor:
    """Monitors one sensor by its messages, the clock and the odometry.

    title: display name, such as "lidar". period: nominal time between two messages from the robot file, s.
    """

    def __init__(self, title: str, period: float) -> None:
        self.title = title
        self.limit_ns = max(round(MAX_AGE_PERIODS * period * 1e9), MIN_MAX_AGE_NS)
        self._last: SensorView | None = None
        self._received_ns = self._changed_ns = self._placed_ns = 0
        self._pose: SE2 | None = None
        self._changed_pose: SE2 | None = None
        self._noisy = self._was_near = False
        self._noisy_messages = 0
        self._edges = np.array([np.inf, np.inf])
        self._valid_messages = 0
        self._fault = f"The {title} has not sent anything yet."

    def process_view(self, view: SensorView, now_ns: int, pose: SE2 | None) -> None:
        """Process a message; `pose` is the robot's pose in odom, or None if unknown."""
        last = self._last
        self._detect_noise(view, pose)
        if last is None or not np.array_equal(view.data, last.data, equal_nan=True):
            self._changed_ns, self._changed_pose = view.stamp_ns, pose
        if last is None:
            self._placed_ns = view.stamp_ns  # transforms get the same timeout as messages
        elif view.stamp_ns - last.stamp_ns > self.limit_ns:
            self._placed_ns = view.stamp_ns  # as of the first message
            self._set_fault(f"The {self.title} sends too seldom: two messages lay {self._limit_text} apart.")
        self._was_near = view.near or (self._was_near and not view.met.any())
        self._edges = np.minimum(self._edges, _from_edges(view.mute))
        self._last, self._pose, self._received_ns = view, pose, now_ns
        self._valid_messages += 1

    @property
    def has_sent(self) -> bool:
        """Whether the sensor has sent anything."""
        return self._last is not None

    def note_marked(self, stamp_ns: int) -> None:
        """Note that the data of this time were marked in the costmap."""
        self._placed_ns = stamp_ns

    def fault(self, now_ns: int, pose: SE2 | None) -> str:
        """Return why no twist may be commanded now, or an empty string while the data are valid."""
        if self._last is None:
            return self._fault
        fault = self._find_fault(self._last, now_ns, pose)
        if fault:
            self._set_fault(fault)
        return self._fault if self._valid_messages < VALID_MESSAGES_REQUIRED else ""

    def blind(self, known: NDArray[np.bool_] | None = None) -> bool:
        """Return whether the newest message has no data in a quarter of the field of view or more, or none at all.

        known: (n,) directions whose missing data are explained; these do not count.
        """
        if self._last is None:
            return False
        if not len(self._last.mute):
            return True
        mute = self._last.mute if known is None else self._last.mute & ~known
        size, longer = divmod(len(mute), 4)
        edges = [quarter * size + min(quarter, longer) for quarter in range(5)]
        missing = (
            np.count_nonzero(mute[a:b]) > BLIND_FRACTION * (b - a) for a, b in pairwise(edges) if b > a
        )
        return any(missing) or self._surfaces_vanished

    def hidden_at_edge(self, known: NDArray[np.bool_] | None = None) -> bool:
        """Return whether the newest message has no data from an edge of the field of view on, as if something too
        near to be seen had come in from the side.

        known: as for `blind`. Bands at the edges that a camera never measures do not count.
        """
        if self._last is None or not len(self._last.mute):
            return False
        mute = self._last.mute if known is None else self._last.mute & ~known
        return bool((_from_edges(mute) - self._edges > EDGE_FRACTION * len(mute)).any())

    @property
    def measurable(self) -> slice:
        """The directions of the newest message without the bands at the edges that the sensor never measures."""
        count = 0 if self._last is None else len(self._last.mute)
        right, left = np.minimum(self._edges, count).astype(int).tolist()
        return slice(right, max(right, count - left))

    @property
    def _surfaces_vanished(self) -> bool:
        """Whether near surfaces of the previous message have vanished on all sides, which is implausible."""
        return self._last is not None and self._was_near and not self._last.met.any()

    @property
    def _limit_text(self) -> str:
        return f"more than {self.limit_ns / 1e9:.1f} s"

    def _set_fault(self, fault: str) -> None:
        self._fault, self._valid_messages = fault, 0

    def _find_fault(self, last: SensorView, now_ns: int, pose: SE2 | None) -> str:
        limit = self.limit_ns
        delayed = self._received_ns - last.stamp_ns > limit
        if now_ns - self._received_ns > limit or (now_ns - last.stamp_ns > limit and not delayed):
            return f"The {self.title} has sent nothing for {self._limit_text}."
        if last.stamp_ns - now_ns > CLOCK_TOLERANCE_NS:
            return f"The {self.title}'s data are stamped in the future: compare its computer's clock with this one's."
        if now_ns - last.stamp_ns > limit:
            return f"The {self.title}'s data come late: they are {self._limit_text} old."
        if now_ns - self._changed_ns > limit and self._should_differ(pose):
            return f"The {self.title} is frozen: it keeps sending the same data."
        if now_ns - self._placed_ns > limit:
            return (
                f"There is no transform from {last.frame} to odom for the {self.title}; "
                "check the odometry, /tf_static and the driver's frame_id."
            )
        return ""

    def _detect_noise(self, view: SensorView, pose: SE2 | None) -> None:
        """Detect a sensor with noise: its data differ at standstill; from then on equal data are frozen."""
        known = pose is not None and self._pose is not None
        standing = known and not _moved_more_than(pose, self._pose, STANDSTILL_DISTANCE, STANDSTILL_ANGLE)
        self._noisy_messages = self._noisy_messages + 1 if standing and self._differs(view) else 0
        self._noisy = self._noisy or self._noisy_messages >= NOISY_MESSAGES

    def _differs(self, view: SensorView) -> bool:
        last = self._last
        if last is None or view.data.shape != last.data.shape:
            return False
        both = view.measured & last.measured
        if int(both.sum()) < MIN_NOISE_DIRECTIONS:
            return False
        with np.errstate(invalid="ignore"):
            differs = (np.abs(view.data[both] - last.data[both]) > NOISE_THRESHOLD).any(axis=1)
        return float(differs.mean()) > NOISY_FRACTION

    def _should_differ(self, pose: SE2 | None) -> bool:
        """Return whether equal data are a fault; without measurements there is nothing that could differ.

        Bare floor looks the same from everywhere to a camera without noise.
        """
        assert self._last is not None
        known = pose is not None and self._changed_pose is not None
        moved = known and _moved_more_than(pose, self._changed_pose, MOVED_DISTANCE, MOVED_ANGLE)
        return (self._noisy and bool(self._last.measured.any())) or (moved and bool(self._last.met.any()))


def _moved_more_than(a: SE2 | None, b: SE2 | None, distance: float, angle: float) -> bool:
    assert a is not None and b is not None
    return a.distance(b) > distance or abs(wrap(a.yaw - b.yaw)) > angle


def _from_edges(mute: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the number of directions without data in a row from the first one on, and from the last one back."""
    runs = [len(mute) if side.all() else int(np.argmin(side)) for side in (mute, mute[::-1])]
    return np.array(runs, np.float64)
