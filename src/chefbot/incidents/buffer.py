"""The last minute of publications, in memory."""

from __future__ import annotations

from collections import deque

import msgspec

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import ParticleCloud
from chefbot.msgs.nav_msgs import OccupancyGrid, Odometry
from chefbot.msgs.sensor_msgs import CameraInfo, CompressedImage, Image
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.loop import Publication

SPAN_NS = 60_000_000_000
"""Time that is kept, ns."""
PERIODS_NS: dict[type[Message], int] = {
    Image: 5_000_000_000,
    CompressedImage: 5_000_000_000,
    OccupancyGrid: 5_000_000_000,
    ParticleCloud: 1_000_000_000,
    CameraInfo: 5_000_000_000,
    Odometry: 100_000_000,
    WheelTicks: 100_000_000,
}
"""Minimum time between two kept messages of a topic, ns, for types whose messages are large or frequent."""
Key = tuple[str, ...]


class Thinning:
    """Decides which messages are kept, so that a minute takes about 20 MB: of large or frequent types a part."""

    def __init__(self) -> None:
        self._kept_ns: dict[Key, int] = {}

    def keeps(self, publication: Publication) -> bool:
        """Return whether a publication is kept."""
        period_ns = PERIODS_NS.get(type(publication.message))
        if period_ns is None:
            return True
        key = key_of(publication)
        if publication.time_ns - self._kept_ns.get(key, -period_ns) < period_ns:
            return False
        self._kept_ns[key] = publication.time_ns
        return True


class IncidentBuffer:
    """Observes a loop; keeps what was published in the last minute, and the last message of each topic before it.

    Of types with large or frequent messages it keeps a part.
    """

    def __init__(self, span_ns: int = SPAN_NS) -> None:
        self._span_ns = span_ns
        self._recent: deque[Publication] = deque()
        self._before: dict[Key, Publication] = {}
        self._thinning = Thinning()
        self._newest: dict[Key, Publication] = {}
        """The latest message of each topic of which not all messages are kept."""

    def __call__(self, publication: Publication) -> None:
        """Keep a publication, and drop those that are too old by now."""
        if type(publication.message) in PERIODS_NS:
            self._newest[key_of(publication)] = publication
        if not self._thinning.keeps(publication):
            return
        self._recent.append(publication)
        while self._recent[0].time_ns < publication.time_ns - self._span_ns:
            old = self._recent.popleft()
            self._before[key_of(old)] = old

    def content(self) -> list[Publication]:
        """Return what is kept, in the order of publication; what is older, with the time of the minute's begin."""
        begin_ns = self._recent[-1].time_ns - self._span_ns if self._recent else 0
        kept = {id(publication) for publication in self._recent}
        newest = [one for one in self._newest.values() if id(one) not in kept]
        everything = sorted([*self._before.values(), *self._recent, *newest], key=lambda one: one.time_ns)
        return [
            one if one.time_ns >= begin_ns else msgspec.structs.replace(one, time_ns=begin_ns)
            for one in everything
        ]


def key_of(publication: Publication) -> Key:
    """Return what a later message replaces: its topic and publisher, of transforms only the same frames."""
    message = publication.message
    frames = [one.child_frame_id for one in message.transforms] if isinstance(message, TFMessage) else []
    return publication.topic, publication.publisher, *frames
