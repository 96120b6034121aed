"""A publisher compatible with rmw_zenoh."""

from __future__ import annotations

import threading
import time
from typing import Any, Generic, TypeVar

import zenoh
from zenoh import ext

from chefbot.msgs.idl.message import Message
from chefbot.ros2.rmw.attachment import pack
from chefbot.ros2.rmw.qos import KEEP_ALL, QoS
from chefbot.ros2.rmw.session import RmwContext

M = TypeVar("M", bound=Message)
HEARTBEAT = 1.0
"""Period in seconds at which the last sequence number of a reliable latched topic is sent: a subscriber that finds
that it missed samples queries them. It is sent as long as the publisher exists, since one heartbeat alone
(`sporadic_heartbeat`) and the query of a late publisher may both be lost before a route to the subscriber stands."""


class Publisher(Generic[M]):
    """A publisher on one topic, created by `RmwNode.publisher`. Thread-safe."""

    def __init__(self, wire: RmwContext, key: str, qos: QoS, gid: bytes) -> None:
        self.qos = qos
        self.gid = gid
        self._sequence = 0
        self._lock = threading.Lock()
        self._status_lock = (
            threading.Lock()
        )  # its own: a control loop that checks must not wait for a blocked `put`
        self._zenoh = _declare(wire.session, key, qos)

    @property
    def has_subscribers(self) -> bool:
        """Return whether publishing has a recipient.

        Always true for a latched topic, else only if a subscriber outside this process matches.
        """
        if self.qos.latched:
            return True
        with self._status_lock:
            return bool(getattr(self._zenoh.matching_status, "matching", False))

    def publish(self, message: M) -> None:
        """Publish a message; raises CdrError when a value does not fit its field."""
        self.publish_cdr(message.to_cdr())

    def publish_cdr(self, data: bytes) -> None:
        """Publish a message that is already serialized as CDR."""
        with self._lock:  # sequence numbers must have the order of the samples
            self._sequence += 1
            attachment = pack(self._sequence, time.time_ns(), self.gid)
            self._zenoh.put(data, attachment=attachment)

    def close(self) -> None:
        """Undeclare the publisher from the Zenoh session, after a thread that is publishing."""
        with self._lock, self._status_lock:  # Zenoh raises RuntimeError if a call is in progress
            self._zenoh.undeclare()


def _declare(session: zenoh.Session, key: str, qos: QoS) -> Any:
    """Declare the publisher; congestion drops samples unless reliable with keep all (rmw_publisher_data)."""
    lossless = qos.reliable and qos.history == KEEP_ALL
    settings: dict[str, Any] = {
        "congestion_control": zenoh.CongestionControl.BLOCK if lossless else zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if qos.reliable else zenoh.Reliability.BEST_EFFORT,
    }
    if not qos.latched:
        return session.declare_publisher(key, **settings)
    if qos.reliable:
        settings["sample_miss_detection"] = ext.MissDetectionConfig(
            heartbeat=HEARTBEAT, sporadic_heartbeat=None
        )
    cache = ext.CacheConfig(max_samples=qos.depth)
    return ext.declare_advanced_publisher(session, key, cache=cache, publisher_detection=True, **settings)
