"""A publisher as rmw_zenoh has it."""

from __future__ import annotations

import threading
import time
from typing import Any, Generic, TypeVar

import zenoh
from zenoh import ext

from chefbot.msgs.idl.message import Message
from chefbot.ros2.rmw.attachment import pack
from chefbot.ros2.rmw.qos import KEEP_ALL, QoS
from chefbot.ros2.rmw.session import Wire

M = TypeVar("M", bound=Message)
HEARTBEAT = 0.5
"""Seconds; how soon a late or lossy listener of a reliable latched topic notices what it missed (rmw_zenoh)."""


class Publisher(Generic[M]):
    """Speaks on one topic; made by `WireNode.publisher`. Any thread may publish."""

    def __init__(self, wire: Wire, key: str, qos: QoS, gid: bytes) -> None:
        self.key = key
        self.qos = qos
        self.gid = gid
        self._sequence = 0
        self._lock = threading.Lock()
        self._zenoh = _declare(wire.session, key, qos)

    @property
    def heard(self) -> bool:
        """Whether it is worth speaking: a latched topic is always, another if somebody outside listens."""
        if self.qos.latched:
            return True
        return bool(getattr(self._zenoh.matching_status, "matching", False))

    def publish(self, message: M) -> None:
        """To all who listen. CdrError when a value does not fit its field."""
        self.publish_cdr(message.to_cdr())

    def publish_cdr(self, data: bytes) -> None:
        """A message that is CDR already."""
        with self._lock:  # the order of numbers is that of samples
            self._sequence += 1
            beside = pack(self._sequence, time.time_ns(), self.gid)
            self._zenoh.put(data, attachment=beside)

    def close(self) -> None:
        """Speak no more."""
        self._zenoh.undeclare()


def _declare(session: zenoh.Session, key: str, qos: QoS) -> Any:
    """Congestion drops samples unless nothing at all may be lost (rmw_publisher_data)."""
    keep = qos.reliable and qos.history == KEEP_ALL
    settings: dict[str, Any] = {
        "congestion_control": zenoh.CongestionControl.BLOCK if keep else zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if qos.reliable else zenoh.Reliability.BEST_EFFORT,
    }
    if not qos.latched:
        return session.declare_publisher(key, **settings)
    if qos.reliable:
        settings["sample_miss_detection"] = ext.MissDetectionConfig(
            heartbeat=None, sporadic_heartbeat=HEARTBEAT
        )
    cache = ext.CacheConfig(max_samples=qos.depth)
    return ext.declare_advanced_publisher(session, key, cache=cache, publisher_detection=True, **settings)
