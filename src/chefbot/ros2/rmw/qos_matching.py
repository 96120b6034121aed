"""What to ask of a topic so that all who speak there are heard."""

from __future__ import annotations

from collections.abc import Iterable

from chefbot.ros2.rmw.graph import Named
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.qos import BEST_EFFORT, DEFAULT, RELIABLE, TRANSIENT_LOCAL, VOLATILE, QoS


def ask_for(offered: Iterable[QoS]) -> QoS:
    """QoS that all of these offers satisfy; the strongest such one (as rosbag2 chooses its own)."""
    offers = list(offered)
    if not offers:
        return DEFAULT
    return QoS(
        reliability=RELIABLE if all(one.reliable for one in offers) else BEST_EFFORT,
        durability=TRANSIENT_LOCAL if all(one.latched for one in offers) else VOLATILE,
        depth=max(DEFAULT.depth, *(one.depth for one in offers)),
    )


def types_said(named: Named) -> list[WireType]:
    """The types of its publishers or servers; while there are none, those that others ask for."""
    ends = named.givers or named.takers
    return list(dict.fromkeys(one.end.type for one in ends))
