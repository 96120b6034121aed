"""Chains of causes: reports of all nodes, joined with each other, with the static map and with the tracked people."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from chefbot.causes.reports import END, FAILURE, LATENESS_NS, MAP, SEVERITY, is_zone
from chefbot.causes.sentences import NOT_ON_MAP, ON_MAP, PERSON, joined, place_links, place_sentence
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause, Quantity
from chefbot.msgs.geometry_msgs import Point, Pose
from chefbot.msgs.std_msgs import Header

LINK_NS = 1_500_000_000
"""Time for which a cause that has ended may still be what another node acts on, ns: a recovery begins afterwards."""
UPSTREAM = {
    "navigator": ("controller", "planner", "base"),
    "delivery": ("navigator",),
    "controller": ("base",),
}
"""Nodes whose checks are behind those of a node."""
MAP_REACH = 0.15
"""Distance from an obstacle of the static map up to which a place is one of it, m: three cells of error of pose."""
PERSON_REACH = 0.5
"""Distance from the middle of a tracked person up to which a mark belongs to that person, m: half a width and the
lag of a stride."""
ROOTS = ("localization", "emergency stop", "battery charge", "heartbeat", "cancelled goal", "sensor data")
"""Checks that have no other cause behind them: their sentences name what is wrong."""
MAX_KEPT = 200
"""Causes that are kept to be linked."""


class TrackedPoint(NamedTuple):
    """A tracked person: number, x and y in the frame map, m."""

    person: int
    x: float
    y: float


class _Kept(NamedTuple):
    cause: Cause
    ended_ns: int | None

    @property
    def holds(self) -> bool:
        """Whether it has not ended; a failure does not last."""
        return self.ended_ns is None and self.cause.kind != FAILURE


class CauseChains:
    """Adds to each report its number, the cause behind it, its obstacle, and the sentence of the chain."""

    def __init__(self) -> None:
        self._map: Grid | None = None
        self._next = 1
        self._kept: dict[int, _Kept] = {}
        self.people: Sequence[TrackedPoint] = ()
        """The people that are tracked now, in the frame map."""

    def set_map(self, grid: Grid) -> None:
        """Set the static map, with which the places of causes are compared."""
        self._map = grid

    def process(self, report: Cause, frame: SE2 | None, robot: SE2 | None) -> Cause | None:
        """Return the cause with its chain; None for an end without a begin.

        frame: pose of the report's frame in the frame map, None if it is not known. robot: its pose in the frame map.
        """
        if report.kind == END:
            return self._end(report)
        cause = _placed(report, frame, robot)
        cause = self._identify(cause)
        cause = self._linked(msgspec.structs.replace(cause, id=self._next))
        self._next += 1
        self._kept[cause.id] = _Kept(cause, None)
        if len(self._kept) > MAX_KEPT:
            del self._kept[min(self._kept)]
        return cause

    @property
    def present(self) -> list[int]:
        """The ids of the causes that hold now."""
        return [number for number, kept in self._kept.items() if kept.holds]

    def lost_ends(self, node: str, checks: Sequence[str], now_ns: int) -> list[Cause]:
        """Return the ends of the causes of a node that hold here, but are not among these checks."""
        counts = Counter(checks)
        ends = []
        for number in sorted(self._kept, reverse=True):  # of several of one check, the newest hold
            cause = self._kept[number].cause
            if cause.node != node or not self._kept[number].holds:
                continue
            counts[cause.check] -= 1
            if counts[cause.check] < 0 and now_ns - cause.header.stamp.ns > LATENESS_NS:
                ends.append(self._close(number, now_ns))
        return ends

    # -- the obstacle

    def _identify(self, cause: Cause) -> Cause:
        """Name the obstacle: the nearest tracked person, or whether the static map has it."""
        if not cause.located or cause.header.frame_id != "map" or is_zone(cause.sensor):
            return cause
        x, y = cause.point.x, cause.point.y
        near = [(math.hypot(one.x - x, one.y - y), one.person) for one in self.people]
        distance, person = min(near, default=(math.inf, -1))
        if distance <= PERSON_REACH and cause.sensor != MAP:
            return msgspec.structs.replace(cause, obstacle=PERSON, person=person)
        if self._map is None:
            return cause
        return msgspec.structs.replace(cause, obstacle=ON_MAP if is_mapped(self._map, x, y) else NOT_ON_MAP)

    # -- the chain

    def _linked(self, cause: Cause) -> Cause:
        """Join a cause with the one behind it; without a place of its own it has the place of that one."""
        behind = None if cause.located or cause.check in ROOTS else self._behind(cause)
        own = f"{cause.node}: {cause.check}"
        if behind is None:
            sentence = " ".join(part for part in (cause.sentence, place_sentence(cause)) if part)
            return msgspec.structs.replace(cause, chain=(own, *place_links(cause)), sentence=sentence)
        sentence = joined(cause.sentence, behind.sentence)
        found = {
            name: getattr(behind, name)
            for name in ("sensor", "located", "point", "marked_at", "obstacle", "person")
        }
        if not cause.header.frame_id:
            found["header"] = Header.of(cause.header.stamp.ns, behind.header.frame_id)
        return msgspec.structs.replace(
            cause, caused_by=behind.id, chain=(own, *behind.chain), sentence=sentence, **found
        )

    def _behind(self, cause: Cause) -> Cause | None:
        """Return the most severe, then the latest cause of an upstream node that holds or held a moment ago."""
        now_ns, nodes = cause.header.stamp.ns, UPSTREAM.get(cause.node, ())

        def holds(kept: _Kept) -> bool:
            began_ns = kept.cause.header.stamp.ns
            ended_ns = began_ns if kept.cause.kind == FAILURE else kept.ended_ns  # a failure does not last
            return ended_ns is None or now_ns - ended_ns <= LINK_NS

        found = [kept.cause for kept in self._kept.values() if kept.cause.node in nodes and holds(kept)]
        return max(found, key=lambda one: (SEVERITY.get(one.kind, 0), one.id), default=None)

    def _end(self, report: Cause) -> Cause | None:
        """Return the end of the latest open cause of the same check."""
        for number in sorted(self._kept, reverse=True):
            cause, ended_ns = self._kept[number]
            if ended_ns is None and (cause.node, cause.check) == (report.node, report.check):
                return self._close(number, report.header.stamp.ns)
        return None

    def _close(self, number: int, now_ns: int) -> Cause:
        cause = self._kept[number].cause
        self._kept[number] = _Kept(cause, now_ns)
        seconds = (now_ns - cause.header.stamp.ns) / 1e9
        return msgspec.structs.replace(
            cause,
            header=Header.of(now_ns, cause.header.frame_id),
            kind=END,
            numbers=(Quantity("duration", seconds, "s"),),
            sentence=f"Ended after {seconds:.1f} s: {cause.sentence}",
        )


def is_mapped(grid: Grid, x: float, y: float) -> bool:
    """Return whether the static map has an obstacle within MAP_REACH of a point, m."""
    reach = MAP_REACH / grid.resolution
    row, column = (y - grid.origin_y) / grid.resolution - 0.5, (x - grid.origin_x) / grid.resolution - 0.5
    top, left = max(math.floor(row - reach), 0), max(math.floor(column - reach), 0)
    window = grid.cells[top : math.ceil(row + reach) + 1, left : math.ceil(column + reach) + 1]
    rows, columns = np.nonzero(window >= OCCUPIED_THRESHOLD)
    return bool((np.hypot(rows + top - row, columns + left - column) <= reach).any())


def _placed(report: Cause, frame: SE2 | None, robot: SE2 | None) -> Cause:
    """Return the report with its point and the robot in the frame map, if that is known."""
    if frame is None or robot is None:
        return report
    x, y = (float(value) for value in frame.apply(np.array([[report.point.x, report.point.y]]))[0])
    point = Point(x, y, 0.0) if report.located else report.point
    header = Header.of(report.header.stamp.ns, "map")
    return msgspec.structs.replace(report, header=header, point=point, robot=Pose.of(robot))
