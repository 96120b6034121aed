"""The planar transform tree over time (REP-105); one buffer per loop, filled from /tf and /tf_static."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

from chefbot.errors import ChefbotError
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.tf2_msgs import TFMessage

CACHE_TIME_NS = 10_000_000_000
"""Length of the buffered history, ns."""
FUTURE_TOLERANCE_NS = 500_000_000
"""Time by which a dynamic transform may be ahead of the clock, ns: a process that lags behind another."""
POSTDATED_NS = 2_000_000_000
"""The same for transforms from `map`, ns: localizations post-date them, so that they hold until the next one."""
MAX_FRAMES = 1000
"""Maximum number of frames in the tree."""
MAX_WAITING = 100
"""Maximum number of pending requests; the oldest are dropped, as their frame is no longer published."""


Guard = Callable[[Callable[[SE2], None]], Callable[[SE2], None]]
_Route = tuple[tuple[str, ...], tuple[str, ...]]


class TransformError(ChefbotError):
    """The requested transform is not available; the message names the frame or time that is missing."""


class _FutureError(TransformError):
    """The pose of the frame `child` is not known up to the requested time yet."""

    def __init__(self, message: str, child: str) -> None:
        super().__init__(message)
        self.child = child


@dataclass
class _PendingRequest:
    """A pending request for a transform that is not available yet.

    missing: the frame whose pose was not known up to the requested time; empty if a frame is unknown.
    """

    target: str
    source: str
    stamp_ns: int
    action: Callable[[SE2], None]
    missing: str = ""


class _Edge:
    """The buffered poses of a child frame in its parent frame."""

    def __init__(self, parent: str, static: bool) -> None:
        self.parent = parent
        self.static = static
        self.stamps: deque[int] = deque()
        self.poses: deque[SE2] = deque()

    def add(self, stamp: int, pose: SE2) -> None:
        """Insert a pose at its stamp; a second one of the same stamp replaces the first, as in tf2 of ROS 2."""
        if self.static:
            self.stamps.clear()
            self.poses.clear()
        i = bisect_left(self.stamps, stamp)
        if i < len(self.stamps) and self.stamps[i] == stamp:
            self.poses[i] = pose
            return
        self.stamps.insert(i, stamp)
        self.poses.insert(i, pose)
        while self.stamps[-1] - self.stamps[0] > CACHE_TIME_NS:
            self.stamps.popleft()
            self.poses.popleft()

    def at(self, stamp: int | None, child: str) -> SE2:
        if self.static or stamp is None or stamp == self.stamps[-1]:
            return self.poses[-1]
        if stamp > self.stamps[-1]:
            late = (stamp - self.stamps[-1]) / 1e9
            raise _FutureError(
                f"{self.parent} -> {child} is known only up to {late:.3f} s before the requested time", child
            )
        if stamp < self.stamps[0]:
            raise TransformError(f"{self.parent} -> {child} was not known yet at the requested time")
        return self._interpolate(stamp)

    def _interpolate(self, stamp: int) -> SE2:
        # neighbours in time: t0 <= stamp < t1
        i = bisect_right(self.stamps, stamp)
        if i == len(self.stamps):
            return self.poses[-1]
        (t0, t1), (a, b) = islice(self.stamps, i - 1, i + 1), islice(self.poses, i - 1, i + 1)
        # linear interpolation in x and y, along the shorter way in yaw
        f = (stamp - t0) / (t1 - t0)
        return SE2(a.x + f * (b.x - a.x), a.y + f * (b.y - a.y), wrap(a.yaw + f * wrap(b.yaw - a.yaw)))


class TransformBuffer:
    """A transform buffer that interpolates between transforms and never extrapolates."""

    def __init__(self, guard: Guard = lambda action: action) -> None:
        """Create an empty buffer; `guard` wraps each action so that its exception does not affect others."""
        self._guard = guard
        self._edges: dict[str, _Edge] = {}
        self._routes: dict[tuple[str, str], _Route] = {}
        """The routes looked up since the tree has changed."""
        self._pending: list[_PendingRequest] = []

    def add_transforms(self, message: TFMessage, static: bool, now_ns: int | None = None) -> None:
        """Add the transforms of a /tf or /tf_static message; dynamic ones must not be ahead of the clock `now_ns`.

        A frame stays static or dynamic as first received, and a static frame keeps its parent: otherwise a
        single message could detach a sensor, whose transform is sent only once, from the robot for good.
        TransformError, after all valid transforms were added, if one of them was refused.
        """
        refused: list[str] = []
        for transform in message.transforms:
            reason = "" if static or now_ns is None else self._future_reason(transform, now_ns)
            reason = reason or self._add(transform, static)
            if reason:
                refused.append(reason)
        self._serve_pending()
        if refused:
            raise TransformError(refused[0])

    def _future_reason(self, stamped: TransformStamped, now_ns: int) -> str:
        """Return why a transform from the future is refused, and whose clock is wrong; empty for any other.

        It would hide all later ones of its frame. If another frame moves at the present time, this clock is right.
        """
        child, parent = stamped.child_frame_id, stamped.header.frame_id
        ahead_ns = stamped.header.stamp.ns - now_ns
        if ahead_ns <= (POSTDATED_NS if parent == "map" else FUTURE_TOLERANCE_NS):
            return ""
        moving = [edge.stamps[-1] for name, edge in self._edges.items() if not edge.static and name != child]
        agrees = any(abs(stamp - now_ns) <= FUTURE_TOLERANCE_NS for stamp in moving)
        clock = "the clock of its publisher" if agrees else "the clock of its publisher or this one"
        reason = f"{clock} is wrong, or this computer is too slow"
        return f"{parent} -> {child} is stamped {ahead_ns / 1e9:.6g} s ahead of the robot's clock: {reason}"

    def _add(self, stamped: TransformStamped, static: bool) -> str:
        """Add a transform to the tree, or return the reason why it is refused."""
        child, parent = stamped.child_frame_id, stamped.header.frame_id
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
            self._routes.clear()
        pose = SE2(
            stamped.transform.translation.x, stamped.transform.translation.y, stamped.transform.rotation.yaw
        )
        edge.add(stamped.header.stamp.ns, pose)
        return ""

    def on_available(self, target: str, source: str, stamp_ns: int, action: Callable[[SE2], None]) -> None:
        """Call `action` with `target_T_source` at `stamp_ns`, now or as soon as it is available.

        A request whose time is older than the buffer is dropped, as it can never be answered.
        """
        self._pending.append(_PendingRequest(target, source, stamp_ns, self._guard(action)))
        self._serve_pending()

    def _serve_pending(self) -> None:
        pending, self._pending = self._pending, []
        for request in pending:
            missing = self._edges.get(request.missing)
            if missing is not None and missing.stamps[-1] < request.stamp_ns:
                self._keep_if_answerable(request)
                continue
            try:
                pose = self.lookup(request.target, request.source, request.stamp_ns)
            except TransformError as error:
                request.missing = error.child if isinstance(error, _FutureError) else ""
                self._keep_if_answerable(request)
            else:
                request.action(pose)
        del self._pending[:-MAX_WAITING]

    def _keep_if_answerable(self, request: _PendingRequest) -> None:
        """Keep a request for a frame that may still be published.

        Drop one whose time is before the buffer.
        """
        newest = [edge.stamps[-1] for edge in self._edges.values() if not edge.static]
        if not newest or request.stamp_ns >= max(newest) - CACHE_TIME_NS // 10:
            self._pending.append(request)

    def lookup(self, target: str, source: str, stamp_ns: int | None = None) -> SE2:
        """Return `target_T_source` at a time, or the latest one; TransformError if it is not available."""
        above_target, above_source = self._route(target, source)
        if not above_target:
            return self._chain(above_source, stamp_ns)
        # by way of the lowest common ancestor: inverse(common_T_target) @ common_T_source
        common_T_target = self._chain(above_target, stamp_ns)
        return common_T_target.inverse() @ self._chain(above_source, stamp_ns)

    def newest_ns(self, child: str) -> int | None:
        """Return the stamp of the newest transform of a moving frame, ns; None for a static or an unknown one."""
        edge = self._edges.get(child)
        return None if edge is None or edge.static else edge.stamps[-1]

    def newest_stamp(self, target: str, source: str) -> int | None:
        """Return the time of the newest transform between two frames, ns; None if fixed ones alone join them.

        It is that of the oldest of the chain's newest transforms. TransformError if no chain joins them.
        """
        edges = [self._edges[frame] for frames in self._route(target, source) for frame in frames]
        return min((edge.stamps[-1] for edge in edges if not edge.static), default=None)

    def clear(self) -> None:
        """Clear pending requests and dynamic transforms, as after a restart."""
        self._pending.clear()
        self._edges = {child: edge for child, edge in self._edges.items() if edge.static}
        self._routes.clear()

    def _route(self, target: str, source: str) -> _Route:
        """Return the frames below the lowest common ancestor of two, upwards from each of them."""
        route = self._routes.get((target, source))
        if route is None:
            above_target, above_source = self._ancestors(target), self._ancestors(source)
            common = next((frame for frame in above_source if frame in above_target), None)
            if common is None:
                raise TransformError(f"no chain of transforms joins {target} and {source}")
            below = [frames[: frames.index(common)] for frames in (above_target, above_source)]
            route = self._routes[target, source] = tuple(below[0]), tuple(below[1])
        return route

    def _ancestors(self, frame: str) -> list[str]:
        """Return the frame and all its ancestors up to the root."""
        chain = [frame]
        while chain[-1] in self._edges:
            chain.append(self._edges[chain[-1]].parent)
            if chain[-1] in chain[:-1]:
                raise TransformError(f"the transforms above {frame} run in a circle")
        return chain

    def _chain(self, frames: tuple[str, ...], stamp_ns: int | None) -> SE2:
        """Return the pose of the first frame in the parent of the last; only these edges need to cover the time."""
        if not frames:
            return IDENTITY
        pose = self._edges[frames[0]].at(stamp_ns, frames[0])
        for frame in frames[1:]:
            pose = self._edges[frame].at(stamp_ns, frame) @ pose
        return pose
