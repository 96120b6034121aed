"""QoS for a subscription that matches every publisher of a topic."""

from __future__ import annotations

from collections.abc import Iterable

from chefbot.ros2.rmw.graph import Named
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.qos import BEST_EFFORT, DEFAULT, RELIABLE, TRANSIENT_LOCAL, VOLATILE, QoS


def ask_for(offered: Iterable[QoS]) -> QoS:
    """Return the strongest QoS that all of these offers satisfy (chosen as in rosbag2)."""
    offers = list(offered)
    if not offers:
        return DEFAULT
    return QoS(
        reliability=RELIABLE if all(offer.reliable for offer in offers) else BEST_EFFORT,
        durability=TRANSIENT_LOCAL if all(offer.latched for offer in offers) else VOLATILE,
        depth=max(DEFAULT.depth, *(offer.depth for offer in offers)),
    )


def types_said(named: Named) -> list[WireType]:
    """Return the types of the publishers or servers; if there are none, those of subscriptions or clients."""
    endpoints = named.givers or named.takers
    return list(dict.fromkeys(endpoint.end.type for endpoint in endpoints))
