"""Base of the web UI's device: patrols, following and the shortest round, as the operator orders them."""

from __future__ import annotations

from chefbot.delivery.trays import is_going_home
from chefbot.msgs.chefbot_msgs import DeliveryStatus, FollowOrder, NavigationStatus, PatrolOrder
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import In, Out
from chefbot.ui import commands as do
from chefbot.ui.access.audited_device import AuditedDevice
from chefbot.ui.display.message_conversion import navigation_reason


class MissionDevice(AuditedDevice):
    """Publishes the operator's orders to patrol, to follow, and to sort the tables of a round."""

    patrol: Out[PatrolOrder]
    follow_order: Out[FollowOrder]
    round_shortest: Out[String]
    round_choice: Out[String]
    delivery_status: In[DeliveryStatus]
    navigation_status: In[NavigationStatus]

    def start(self) -> None:
        """Start without a goal of the time before a mission."""
        super().start()
        self._old_navigation: NavigationStatus | None = None

    def _navigation_reason(self, *, exploring: bool) -> str:
        """Return why the navigation holds or has ended a goal, unless a mission has been ordered since."""
        status = self.navigation_status.last
        return "" if status is self._old_navigation else navigation_reason(status, exploring=exploring)

    def _execute_mission(self, command: do.Patrol | do.Follow | do.ShortestOrder) -> None:
        if not isinstance(command, do.ShortestOrder):
            self._old_navigation = self.navigation_status.last
            if self.delivery_status.last is not None and is_going_home(self.delivery_status.last):
                self.round_choice.publish(String("end"))
        match command:
            case do.Follow(person):
                self.follow_order.publish(FollowOrder(person))
            case do.Patrol(places, rounds, without_stops):
                self.patrol.publish(PatrolOrder(tuple(places), rounds, without_stops))
            case do.ShortestOrder(order):
                self.round_shortest.publish(String(order))
