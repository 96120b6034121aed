"""Contacts with obstacles that no sensor sees, which the costmaps mark."""

from __future__ import annotations

from chefbot.control.contact_detector import ContactDetector
from chefbot.msgs.geometry_msgs import PoseStamped, Twist
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.runtime.node import In, Out, topic


class ContactsNode(LocalCostmapNode):
    """Base class of a node that follows paths and publishes where the robot touches something unseen."""

    cmd_vel: In[Twist]
    contact_out: Out[PoseStamped] = topic("contact")

    def start(self) -> None:
        """Create the detector of contacts for a robot that stands."""
        super().start()
        self._contacts = ContactDetector()

    def on_cmd_vel(self, twist: Twist) -> None:
        """Take the twist that the base commands."""
        self._contacts.process(twist.linear.x, twist.angular.z, self.now_ns)

    def publish_contact_if_driven(self) -> None:
        """Publish a contact if one explains that the robot makes no progress on a free path."""
        if self._contacts.explains(self._base_fault, self.now_ns):
            self.contact_out.publish(PoseStamped(Header.of(self.now_ns, "base_link")))
