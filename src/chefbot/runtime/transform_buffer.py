"""The tree of frames over time (REP-105), seen from above; one buffer a loop, fed by /tf and /tf_static."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.tf2_msgs import TFMessage

KEEP_NS = 10_000_000_000
MAX_FRAMES = 1000
MAX_WAITING = 100
"""Older requests are given up: their frame has gone silent."""


Guard = Callable[[Callable[[SE2], None]], Callable[[SE2], None]]


class TransformError(LookupError):
    """The tree cannot answer; the sentence says which frame or time is missing."""


class TooNewError(TransformError):
    """The time asked for has not come yet for one of the frames: wait."""


@dataclass(frozen=True)
class _Waiting:
    """Somebody who wants a transform that is not known yet."""

    target: str
    source: str
    stamp_ns: int
    action: Callable[[SE2], None]


class _Edge:
    """One child's pose in its parent over the last seconds."""

    def __init__(self, parent: str, static: bool) -> None:
        self.parent = parent
        self.static = static
        self.stamps: deque[int] = deque()
        self.poses: deque[SE2] = deque()

    def add(self, stamp: int, pose: SE2) -> None:
        if self.static:
            self.stamps.clear()
            self.poses.clear()
        if self.stamps and stamp <= self.stamps[-1]:
            if stamp == self.stamps[-1]:
                self.poses[-1] = pose
            return  # older than what is known: ROS drops it as well
        self.stamps.append(stamp)
        self.poses.append(pose)
        while stamp - self.stamps[0] > KEEP_NS:
            self.stamps.popleft()
            self.poses.popleft()

    def at(self, stamp: int | None, child: str) -> SE2:
        if self.static or stamp is None or stamp == self.stamps[-1]:
            return self.poses[-1]
        if stamp > self.stamps[-1]:
            late = (stamp - self.stamps[-1]) / 1e9
            raise TransformError(
                f"{self.parent} -> {child} is known only up to {late:.3f} s before the time asked for"
            )
        if stamp < self.stamps[0]:
            raise TransformError(f"{self.parent} -> {child} was not known yet at the time asked for")
        return self._between(stamp)

    def _between(self, stamp: int) -> SE2:
        i = bisect_right(self.stamps, stamp)
        if i == len(self.stamps):
            return self.poses[-1]
        (t0, t1), (a, b) = islice(self.stamps, i - 1, i + 1), islice(self.poses, i - 1, i + 1)
        f = (stamp - t0) / (t1 - t0)
        return SE2(a.x + f * (b.x - a.x), a.y + f * (b.y - a.y), wrap(a.yaw + f * wrap(b.yaw - a.yaw)))


class Transforms:
    """Answers where a frame was; interpolates, never extrapolates."""

    def __init__(self, guard: Guard = lambda action: action) -> None:
        """`guard` makes of each waiting action one that cannot keep the others from being served."""
        self._guard = guard
        self._edges: dict[str, _Edge] = {}
        self._waiting: list[_Waiting] = []

    def receive(self, message: TFMessage, static: bool) -> None:
        """Take in what /tf (or /tf_static) says. TransformError, behind all else, if some of it cannot be.

        A frame stays fixed or moving as it was first said to be, and a fixed one keeps its parent: else a single
        message would take a sensor, which is told of once, off the robot for good.
        """
        refused = [why for one in message.transforms if (why := self._take(one, static))]
        self._serve_waiting()
        if refused:
            raise TransformError(refused[0])

    def _take(self, one: TransformStamped, static: bool) -> str:
        """Add it to the tree, or say why not."""
        child, parent = one.child_frame_id, one.header.frame_id
        edge = self._edges.get(child)
        if edge is None and len(self._edges) >= MAX_FRAMES:
            return f"there are {MAX_FRAMES} frames already; {child} is left out"
        if edge is not None and edge.static != static:
            kinds = ("fixed", "moving") if edge.static else ("moving", "fixed")
            return f"the frame {child} is {kinds[0]}, it cannot become {kinds[1]}"
        if edge is not None and edge.static and edge.parent != parent:
            return f"the frame {child} is fixed to {edge.parent}, it cannot move to {parent}"
        if edge is None or edge.parent != parent:
            if child in self._ancestors(parent):
                return f"{parent} hangs below {child}, it cannot carry it"
            edge = self._edges[child] = _Edge(parent, static)
        pose = SE2(one.transform.translation.x, one.transform.translation.y, one.transform.rotation.yaw)
        edge.add(one.header.stamp.ns, pose)
        return ""

    def when(self, target: str, source: str, stamp_ns: int, action: Callable[[SE2], None]) -> None:
        """Call `action` with `target_T_source` at `stamp_ns`, now or as soon as it is known.

        What is too old to be known is left out: nobody can ever answer it.
        """
        self._waiting.append(_Waiting(target, source, stamp_ns, self._guard(action)))
        self._serve_waiting()

    def _serve_waiting(self) -> None:
        waiting, self._waiting = self._waiting, []
        for one in waiting:
            try:
                pose = self.lookup(one.target, one.source, one.stamp_ns)
            except TooNewError:
                self._waiting.append(one)
            except TransformError:
                self._keep_if_young(one)
            else:
                one.action(pose)
        del self._waiting[:-MAX_WAITING]

    def _keep_if_young(self, one: _Waiting) -> None:
        """A frame that nobody has spoken of may still come; a time before all that is known will not."""
        known = [edge.stamps[-1] for edge in self._edges.values() if not edge.static]
        if not known or one.stamp_ns >= max(known) - KEEP_NS // 10:
            self._waiting.append(one)

    def lookup(self, target: str, source: str, stamp_ns: int | None = None) -> SE2:
        """`target_T_source` at a time, or the newest known. TransformError when the tree cannot say."""
        above_target = self._ancestors(target)
        for frame in self._ancestors(source):
            if frame in above_target:
                down = self._climb(target, frame, stamp_ns)
                return down.inverse() @ self._climb(source, frame, stamp_ns)
        raise TransformError(f"no chain of transforms joins {target} and {source}")

    def forget(self, static_too: bool = False) -> None:
        """As after a restart."""
        self._waiting.clear()
        self._edges = (
            {} if static_too else {child: edge for child, edge in self._edges.items() if edge.static}
        )

    def _ancestors(self, frame: str) -> list[str]:
        """The frame and all above it, upwards."""
        line = [frame]
        while line[-1] in self._edges:
            line.append(self._edges[line[-1]].parent)
            if line[-1] in line[:-1]:
                raise TransformError(f"the transforms above {frame} run in a circle")
        return line

    def _climb(self, frame: str, ancestor: str, stamp_ns: int | None) -> SE2:
        """`ancestor_T_frame`; only the edges between the two need to know the time."""
        pose = IDENTITY
        while frame != ancestor:
            edge = self._edges[frame]
            pose = edge.at(stamp_ns, frame) @ pose
            frame = edge.parent
        return pose
