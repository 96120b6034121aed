"""Quality of service, and rmw_zenoh's text for it: a part that equals its default is left empty."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import CameraInfo, CompressedImage, Image, Imu, LaserScan, PointCloud2, Range
from chefbot.ros2.rmw.errors import WireError

RELIABLE, BEST_EFFORT = 1, 2
TRANSIENT_LOCAL, VOLATILE = 1, 2
KEEP_LAST, KEEP_ALL = 1, 2
AUTOMATIC = 1
RELIABILITY_BEST_AVAILABLE, LIVELINESS_BEST_AVAILABLE = 4, 5
"""Whatever the other end has (rmw/types.h): no end is too weak for it."""
DEFAULT_DEPTH = 42
SENSOR_TYPES: tuple[type[Message], ...] = (
    CameraInfo,
    CompressedImage,
    Image,
    Imu,
    LaserScan,
    PointCloud2,
    Range,
)
"""Heard with best effort, since many drivers send them so."""


class Span(NamedTuple):
    """A span of time as two whole numbers."""

    sec: int
    nanosec: int


INFINITE = Span(9223372036, 854775807)
SPAN_BEST_AVAILABLE = Span(9223372036, 854775806)
"""RMW_QOS_DEADLINE_BEST_AVAILABLE, and that of the lease: no length of time but a marker."""


def is_unlimited(span: Span) -> bool:
    """Whether it sets no limit: infinite, or whatever the other end has."""
    return span >= SPAN_BEST_AVAILABLE


class QoS(NamedTuple):
    """What a publisher offers or a subscription asks for; the defaults are rmw_zenoh's."""

    reliability: int = RELIABLE
    durability: int = VOLATILE
    history: int = KEEP_LAST
    depth: int = DEFAULT_DEPTH
    deadline: Span = INFINITE
    lifespan: Span = INFINITE
    liveliness: int = AUTOMATIC
    lease: Span = INFINITE

    @property
    def latched(self) -> bool:
        """Whether late listeners get what was said before."""
        return self.durability == TRANSIENT_LOCAL

    @property
    def reliable(self) -> bool:
        """Whether nothing may be lost on the way."""
        return self.reliability != BEST_EFFORT

    def __str__(self) -> str:
        """As in a liveliness token."""
        return ":".join(",".join(part) for part in _parts(self))


DEFAULT = QoS(depth=10)
"""Of topics, and of services."""
SENSOR = QoS(reliability=BEST_EFFORT, depth=5)
LATCHED = QoS(durability=TRANSIENT_LOCAL, depth=1)
PARAMETERS = QoS(depth=1000)
ROSOUT = QoS(durability=TRANSIENT_LOCAL, depth=1000, lifespan=Span(10, 0))
FRAMES = QoS(depth=100)
"""Of /tf, as tf2_ros has it on both sides."""
FIXED_FRAMES = QoS(durability=TRANSIENT_LOCAL, depth=100)
"""What a listener to /tf_static asks for (tf2_ros StaticListenerQoS); who speaks there keeps one message."""
CLOCK = QoS(reliability=BEST_EFFORT, depth=1)


def parse_qos(text: str) -> QoS:
    """QoS of a token's last field. WireError when it is none."""
    parts = [part.split(",") for part in text.split(":")]
    defaults = [[str(number) for number in group] for group in _numbers(QoS())]
    if len(parts) < len(defaults) or any(len(p) < len(d) for p, d in zip(parts, defaults, strict=False)):
        raise WireError(f"{text!r} is no QoS: it has too few parts")
    filled = [
        [_number(given or default, text) for given, default in zip(part, group, strict=False)]
        for part, group in zip(parts, defaults, strict=False)
    ]
    (reliability,), (durability,), (history, depth), deadline, lifespan, (liveliness, *lease) = filled
    return QoS(
        *(reliability, durability, history, depth, Span(*deadline), Span(*lifespan), liveliness, Span(*lease))
    )


def incompatible(offered: QoS, asked: QoS) -> list[str]:
    """Why what is offered is less than what is asked for, in words; empty when it is enough.

    The rules of DDS (OMG DDS 1.4, 2.2.3), which ROS 2 reports as "incompatible QoS".
    """
    reasons = []
    if offered.reliability == BEST_EFFORT and asked.reliability == RELIABLE:
        reasons.append("best effort is offered, reliable is asked for")
    if offered.durability == VOLATILE and asked.durability == TRANSIENT_LOCAL:
        reasons.append("volatile is offered, transient local is asked for: nothing said earlier will come")
    if offered.deadline > asked.deadline and not is_unlimited(asked.deadline):
        reasons.append("the deadline offered is longer than the one asked for")
    weaker = offered.liveliness < asked.liveliness != LIVELINESS_BEST_AVAILABLE
    if weaker or (offered.lease > asked.lease and not is_unlimited(asked.lease)):
        reasons.append("the liveliness offered is weaker than the one asked for")
    return reasons


def _numbers(qos: QoS) -> list[list[int]]:
    return [
        [qos.reliability],
        [qos.durability],
        [qos.history, qos.depth],
        list(qos.deadline),
        list(qos.lifespan),
        [qos.liveliness, *qos.lease],
    ]


def _parts(qos: QoS) -> list[list[str]]:
    pairs = zip(_numbers(qos), _numbers(QoS()), strict=True)
    return [["" if a == b else str(a) for a, b in zip(own, default, strict=True)] for own, default in pairs]


def _number(text: str, whole: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 20):
        raise WireError(f"{whole!r} is no QoS: {text!r} is no number")
    return int(text)
