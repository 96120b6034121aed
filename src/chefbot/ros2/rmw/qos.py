"""Quality of service, and rmw_zenoh's text form, in which a part that equals its default is left empty."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import CameraInfo, CompressedImage, Image, Imu, LaserScan, PointCloud2, Range
from chefbot.ros2.rmw.errors import RmwError

RELIABLE, BEST_EFFORT = 1, 2
TRANSIENT_LOCAL, VOLATILE = 1, 2
KEEP_LAST, KEEP_ALL = 1, 2
AUTOMATIC = 1
RELIABILITY_BEST_AVAILABLE, LIVELINESS_BEST_AVAILABLE = 4, 5
"""Policies that match whatever the other endpoint has (rmw/types.h)."""
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
"""Types subscribed to with best effort, since many drivers publish them that way."""


class QosDuration(NamedTuple):
    """A duration as whole seconds and nanoseconds."""

    sec: int
    nanosec: int


INFINITE = QosDuration(9223372036, 854775807)
SPAN_BEST_AVAILABLE = QosDuration(9223372036, 854775806)
"""RMW_QOS_DEADLINE_BEST_AVAILABLE and its lease counterpart: a marker rather than a duration."""


def is_unlimited(span: QosDuration) -> bool:
    """Return whether a duration sets no limit: infinite, or best available."""
    return span >= SPAN_BEST_AVAILABLE


class QoS(NamedTuple):
    """The QoS that a publisher offers or a subscription requests; the defaults are rmw_zenoh's."""

    reliability: int = RELIABLE
    durability: int = VOLATILE
    history: int = KEEP_LAST
    depth: int = DEFAULT_DEPTH
    deadline: QosDuration = INFINITE
    lifespan: QosDuration = INFINITE
    liveliness: int = AUTOMATIC
    lease: QosDuration = INFINITE

    @property
    def latched(self) -> bool:
        """Return whether late-joining subscribers get earlier messages (transient local)."""
        return self.durability == TRANSIENT_LOCAL

    @property
    def reliable(self) -> bool:
        """Return whether delivery is reliable: any reliability policy but best effort."""
        return self.reliability != BEST_EFFORT

    def __str__(self) -> str:
        """Return the text form used in liveliness tokens."""
        return ":".join(",".join(part) for part in _parts(self))


DEFAULT = QoS(depth=10)
"""Default QoS of topics and of services."""
SENSOR_DATA = QoS(reliability=BEST_EFFORT, depth=5)
TRANSIENT_LOCAL_QOS = QoS(durability=TRANSIENT_LOCAL, depth=1)
PARAMETERS = QoS(depth=1000)
ROSOUT = QoS(durability=TRANSIENT_LOCAL, depth=1000, lifespan=QosDuration(10, 0))
TF = QoS(depth=100)
"""QoS of /tf, as in tf2_ros for both publishers and subscriptions."""
TF_STATIC = QoS(durability=TRANSIENT_LOCAL, depth=100)
"""QoS of a /tf_static subscription (tf2_ros StaticListenerQoS); its publishers keep one message."""
CLOCK = QoS(reliability=BEST_EFFORT, depth=1)


def parse_qos(text: str) -> QoS:
    """Parse the QoS field of a token; raises RmwError when it is malformed."""
    parts = [part.split(",") for part in text.split(":")]
    defaults = [[str(number) for number in group] for group in _numbers(QoS())]
    if len(parts) < len(defaults) or any(len(p) < len(d) for p, d in zip(parts, defaults, strict=False)):
        raise RmwError(f"{text!r} is not a QoS: it has too few parts")
    filled = [
        [_number(given or default, text) for given, default in zip(part, group, strict=False)]
        for part, group in zip(parts, defaults, strict=False)
    ]
    (reliability,), (durability,), (history, depth), deadline, lifespan, (liveliness, *lease) = filled
    return QoS(
        reliability,
        durability,
        history,
        depth,
        QosDuration(*deadline),
        QosDuration(*lifespan),
        liveliness,
        QosDuration(*lease),
    )


def incompatible(offered: QoS, requested: QoS) -> list[str]:
    """Return the reasons why an offered QoS does not satisfy a requested one; empty if compatible.

    The rules are those of DDS (OMG DDS 1.4, 2.2.3), which ROS 2 reports as "incompatible QoS".
    """
    reasons = []
    # Reliability and durability: the offer must be at least as strong as the request
    if offered.reliability == BEST_EFFORT and requested.reliability == RELIABLE:
        reasons.append("best effort is offered, reliable is requested")
    if offered.durability == VOLATILE and requested.durability == TRANSIENT_LOCAL:
        reasons.append("volatile is offered, transient local is requested: earlier messages are not received")
    # Deadline: the offered period must not exceed the requested one
    if offered.deadline > requested.deadline and not is_unlimited(requested.deadline):
        reasons.append("the offered deadline is longer than the requested one")
    # Liveliness: kind and lease duration
    weaker = offered.liveliness < requested.liveliness != LIVELINESS_BEST_AVAILABLE
    if weaker or (offered.lease > requested.lease and not is_unlimited(requested.lease)):
        reasons.append("the offered liveliness is weaker than the requested one")
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


def _number(text: str, qos_text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 20):
        raise RmwError(f"{qos_text!r} is not a QoS: {text!r} is not a number")
    return int(text)
