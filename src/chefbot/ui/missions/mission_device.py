"""Base of the web UI's device: patrols, following and the shortest round, as the operator orders them."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import FollowOrder, PatrolOrder
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Out
from chefbot.ui import commands as do
from chefbot.ui.access.audited_device import AuditedDevice


class MissionDevice(AuditedDevice):
    """Publishes the operator's orders to patrol, to follow, and to sort the tables of a round."""

    patrol: Out[PatrolOrder]
    follow_order: Out[FollowOrder]
    round_shortest: Out[String]

    def _execute_mission(self, command: do.Patrol | do.Follow | do.ShortestOrder) -> None:
        match command:
            case do.Follow(person):
                self.follow_order.publish(FollowOrder(person))
            case do.Patrol(places, rounds, without_stops):
                self.patrol.publish(PatrolOrder(tuple(places), rounds, without_stops))
            case do.ShortestOrder(order):
                self.round_shortest.publish(String(order))
