"""QoS for a subscription that matches every publisher of a topic."""

from __future__ import annotations

from collections.abc import Iterable

from chefbot.ros2.rmw.graph import EndpointGroup
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import BEST_EFFORT, DEFAULT, RELIABLE, TRANSIENT_LOCAL, VOLATILE, QoS


def best_matching_qos(offered: Iterable[QoS]) -> QoS:
    """Return the strongest QoS that all of these offers satisfy (chosen as in rosbag2)."""
    offers = list(offered)
    if not offers:
        return DEFAULT
    return QoS(
        reliability=RELIABLE if all(offer.reliable for offer in offers) else BEST_EFFORT,
        durability=TRANSIENT_LOCAL if all(offer.latched for offer in offers) else VOLATILE,
        depth=max(DEFAULT.depth, *(offer.depth for offer in offers)),
    )


def offered_types(named: EndpointGroup) -> list[InterfaceType]:
    """Return the types of the publishers or servers; if there are none, those of subscriptions or clients."""
    endpoints = named.providers or named.consumers
    return list(dict.fromkeys(endpoint.info.type for endpoint in endpoints))
