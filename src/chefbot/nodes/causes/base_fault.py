"""The fault for which the base stands, in nodes that must not go on without it."""

from __future__ import annotations

from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import In, Node, topic


class BaseFaultNode(Node):
    """Base class of a node that waits while a sensor or the motor board keeps the base from driving."""

    base_stop_reason: In[String] = topic("base/stop_reason")

    @property
    def _base_fault(self) -> str:
        """The fault for which the base stands; empty if it does not."""
        return self.base_stop_reason.last.data if self.base_stop_reason.last else ""
