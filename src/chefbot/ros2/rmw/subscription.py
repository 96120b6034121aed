"""A subscription compatible with rmw_zenoh; data that is not a message of its type is counted and rejected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import zenoh
from zenoh import ext, handlers

from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.ros2.rmw.attachment import Attachment, checked, parse
from chefbot.ros2.rmw.errors import ErrorCounter, RmwError
from chefbot.ros2.rmw.qos import QoS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.rmw.thread_state import keep_thread_state

SampleCallback = Callable[[bytes, Attachment], None]
"""Callback for a sample's CDR bytes, in a Zenoh thread; CdrError, InvalidMessageError and RmwError are
counted."""
RawSampleCallback = Callable[[bytes, bytes], None]
"""The same with the raw bytes of the attachment, already checked: most callbacks do not need its fields."""
CPU_BUFFERS = "_buf_cpu"
"""Key suffix where newer rmw_zenoh sends types with `uint8[]` on request (`backends:cpu:`)."""

MAX_PUBLISHERS = 100
"""Maximum number of publishers whose sequence numbers are kept, those of the most recent samples."""


class Subscription:
    """A subscription to one topic, created by `RmwNode.subscription`.

    With `remote_only` samples from this process are ignored. `topic` is the name under which rejected samples
    are counted.
    """

    def __init__(
        self,
        wire: RmwContext,
        key: str,
        qos: QoS,
        take: RawSampleCallback,
        *,
        topic: str,
        remote_only: bool = False,
        buffered: bool = False,
    ) -> None:
        self.qos = qos
        self._callback = take
        self._topic = topic
        self._refused: ErrorCounter = wire.rejected
        origin = zenoh.Locality.REMOTE if remote_only else zenoh.Locality.ANY
        # an indirect callback would cost a thread, and a context switch per sample
        callback = handlers.Callback(self._on_sample, indirect=False)
        keys = [key, f"{key}/{CPU_BUFFERS}"] if buffered else [key]
        self._last: dict[bytes, int] | None = {} if buffered else None
        """Last sequence number of each publisher, where one sample may arrive on both keys; the most recent
        publisher is last."""
        self._zenoh = [_declare(wire.session, each, qos, callback, origin) for each in keys]

    def close(self) -> None:
        """Undeclare the subscription from the Zenoh session."""
        for subscriber in self._zenoh:
            subscriber.undeclare()

    def _on_sample(self, sample: zenoh.Sample) -> None:
        keep_thread_state()
        try:
            data = sample.attachment
            attachment = checked(None if data is None else data.to_bytes())
            if self._last is None or is_new(parse(attachment), self._last):
                self._callback(sample.payload.to_bytes(), attachment)
        except (RmwError, CdrError, InvalidMessageError) as error:
            self._refused.add(f"{self._topic}: {error}")


def is_new(attachment: Attachment, last: dict[bytes, int]) -> bool:
    """Return False for a sample that already arrived on the other key.

    Newer rmw_zenoh publishes on both keys when older subscribers are present.
    """
    previous = last.pop(attachment.gid, 0)
    if len(last) >= MAX_PUBLISHERS:
        del last[next(iter(last))]  # the publisher that has been silent for longest
    last[attachment.gid] = max(previous, attachment.sequence)
    return attachment.sequence > previous


def _declare(
    session: zenoh.Session,
    key: str,
    qos: QoS,
    callback: handlers.Callback[zenoh.Sample],
    origin: zenoh.Locality,
) -> Any:
    if not qos.latched:
        return session.declare_subscriber(key, callback, allowed_origin=origin)
    return ext.declare_advanced_subscriber(
        session,
        key,
        callback,
        allowed_origin=origin,
        history=ext.HistoryConfig(detect_late_publishers=True, max_samples=qos.depth),
        recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True) if qos.reliable else None,
        subscriber_detection=True,
    )
