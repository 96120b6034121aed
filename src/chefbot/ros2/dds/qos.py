"""Conversion of QoS between Zenoh tokens and DDS, and the type hash in a DDS endpoint's user data."""

from __future__ import annotations

import re
from typing import Any

from cyclonedds.core import Policy, Qos

from chefbot.ros2.rmw.qos import (
    BEST_EFFORT,
    KEEP_ALL,
    KEEP_LAST,
    RELIABLE,
    TRANSIENT_LOCAL,
    VOLATILE,
    QoS,
    QosDuration,
)

BLOCKING_NS = 10_000_000
"""Maximum time that a DDS reader without acknowledgements delays the others, per message, ns."""
_TYPE_HASH = re.compile(rb"typehash=(RIHS01_[0-9a-f]{64});")
_NO_LIMIT = -1


def to_dds(qos: QoS, type_hash: str = "") -> Qos:
    """Return the DDS QoS of a reader or writer; `type_hash` goes into its user data (rmw_dds_common qos.cpp).

    Samples are CDR of the first version, like ROS 2's, and are never delivered to this same participant.
    """
    history = (
        Policy.History.KeepAll if qos.history == KEEP_ALL else Policy.History.KeepLast(max(1, qos.depth))
    )
    policies: list[Any] = [
        Policy.Reliability.Reliable(BLOCKING_NS) if qos.reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if qos.latched else Policy.Durability.Volatile,
        history,
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.IgnoreLocal.Participant,
        Policy.Deadline(_ns(qos.deadline)),
        Policy.Liveliness.Automatic(_ns(qos.lease)),
    ]
    if type_hash:
        policies.append(Policy.Userdata(f"typehash={type_hash};".encode()))
    return Qos(*policies)


def to_dds_writer(qos: QoS, type_hash: str = "") -> Qos:
    """Return the DDS QoS of a writer, with lifespan and the history for late-joining readers."""
    writer_qos = to_dds(qos, type_hash) + Qos(Policy.Lifespan(_ns(qos.lifespan)))
    if qos.latched:
        writer_qos += Qos(Policy.DurabilityService(0, writer_qos[Policy.History.KeepLast], *[_NO_LIMIT] * 3))
    return writer_qos


def from_dds(qos: Qos) -> QoS:
    """Return the QoS that a discovered endpoint offers or requests; its history is not announced."""
    reliability, durability = qos[Policy.Reliability], qos[Policy.Durability.Volatile]
    history = qos[Policy.History.KeepLast]
    return QoS(
        reliability=BEST_EFFORT if reliability == Policy.Reliability.BestEffort else RELIABLE,
        durability=VOLATILE if durability in (None, Policy.Durability.Volatile) else TRANSIENT_LOCAL,
        history=KEEP_ALL if history == Policy.History.KeepAll else KEEP_LAST,
        depth=getattr(history, "depth", 1),
    )


def type_hash_of(qos: Qos) -> str:
    """Return 'RIHS01_...' from an endpoint's user data; empty if it has none, as with Humble."""
    data = qos[Policy.Userdata]
    match = None if data is None else _TYPE_HASH.search(data.data)
    return match.group(1).decode() if match else ""


def _ns(span: QosDuration) -> int:
    """Convert a duration to ns; infinity is 2^63 - 1 ns both in rmw and in DDS."""
    return min(span.sec * 1_000_000_000 + span.nanosec, 2**63 - 1)
