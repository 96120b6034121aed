"""Base of the web UI's device: patrols and following, as the operator orders them."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import FollowOrder, PatrolOrder
from chefbot.runtime.node import Out
from chefbot.ui import commands as do
from chefbot.ui.access.audited_device import AuditedDevice


class MissionDevice(AuditedDevice):
    """Publishes the operator's orders to patrol and to follow."""

    patrol: Out[PatrolOrder]
    follow_order: Out[FollowOrder]

    def _execute_mission(self, command: do.Patrol | do.Follow) -> None:
        if isinstance(command, do.Follow):
            self.follow_order.publish(FollowOrder(command.person))
        else:
            self.patrol.publish(PatrolOrder(tuple(command.places), command.rounds, command.without_stops))
