"""A subscription as rmw_zenoh has it: what is no message of its type is counted and refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import zenoh
from zenoh import ext, handlers

from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.validity import InvalidMessageError
from chefbot.ros2.rmw.attachment import Attachment, checked, unpack
from chefbot.ros2.rmw.errors import Tally, WireError
from chefbot.ros2.rmw.qos import QoS
from chefbot.ros2.rmw.session import Wire
from chefbot.ros2.rmw.threads import keep_state

Receive = Callable[[bytes, Attachment], None]
"""Called in Zenoh's thread with a sample's CDR bytes; a CdrError, InvalidMessageError or WireError is counted."""
Take = Callable[[bytes, bytes], None]
"""The same with the attachment's bytes, which are of the right form: most do not look into them."""
CPU_BUFFERS = "_buf_cpu"
"""Where newer rmw_zenoh sends types with `uint8[]` to those who ask for it (`backends:cpu:`)."""

MOST_PUBLISHERS = 100
"""Whose numbers are kept; they come and go."""


class Subscription:
    """Listens to one topic; made by `WireNode.subscription`. `remote_only`: not to this very process.

    `topic` names it in the tally of what was refused.
    """

    def __init__(
        self,
        wire: Wire,
        key: str,
        qos: QoS,
        take: Take,
        *,
        topic: str,
        remote_only: bool = False,
        buffered: bool = False,
    ) -> None:
        self.key = key
        self.qos = qos
        self._give = take
        self._topic = topic
        self._refused: Tally = wire.refused
        origin = zenoh.Locality.REMOTE if remote_only else zenoh.Locality.ANY
        callback = handlers.Callback(self._take, indirect=False)  # else each costs a thread, and a turn of it
        keys = [key, f"{key}/{CPU_BUFFERS}"] if buffered else [key]
        self._last: dict[bytes, int] | None = {} if buffered else None
        """Of each publisher the last number, where one sample may come on both keys."""
        self._zenoh = [_declare(wire.session, one, qos, callback, origin) for one in keys]

    def close(self) -> None:
        """Listen no more."""
        for one in self._zenoh:
            one.undeclare()

    def _take(self, sample: zenoh.Sample) -> None:
        keep_state()
        try:
            found = sample.attachment
            beside = checked(None if found is None else found.to_bytes())
            if self._last is None or self._is_new(unpack(beside), self._last):
                self._give(sample.payload.to_bytes(), beside)
        except (WireError, CdrError, InvalidMessageError) as error:
            self._refused.add(f"{self._topic}: {error}")

    def _is_new(self, attachment: Attachment, last: dict[bytes, int]) -> bool:
        """False for what came on the other key: newer rmw_zenoh speaks on both when older listeners are there."""
        before = last.get(attachment.gid, 0)
        if len(last) >= MOST_PUBLISHERS:
            last.clear()
        last[attachment.gid] = max(before, attachment.sequence)
        return attachment.sequence > before


def _declare(
    session: zenoh.Session,
    key: str,
    qos: QoS,
    take: handlers.Callback[zenoh.Sample],
    origin: zenoh.Locality,
) -> Any:
    if not qos.latched:
        return session.declare_subscriber(key, take, allowed_origin=origin)
    return ext.declare_advanced_subscriber(
        session,
        key,
        take,
        allowed_origin=origin,
        history=ext.HistoryConfig(detect_late_publishers=True, max_samples=qos.depth),
        recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True) if qos.reliable else None,
        subscriber_detection=True,
    )
