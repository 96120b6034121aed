"""Link monitor of a machine that joined a robot: whether it still receives the robot's messages."""

from __future__ import annotations

from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import String
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Device, In, NoParams, Out, every, topic

LINK_TIMEOUT = 1.0
"""Time without a message of the drive base after which the link counts as lost, s; the base publishes its
command at 20 Hz."""


class LinkMonitorDevice(Device):
    """Publishes on `link` what is wrong, or "" if nothing is; on `link/notice` when that changes.

    It measures wall time: where the robot's simulated time is followed, that time stands still while the link
    is lost.
    """

    params: NoParams
    cmd_vel: In[Twist]
    link: Out[String]
    notice: Out[String] = topic("link/notice")

    def start(self) -> None:
        """Start with the link assumed to be up."""
        self._received_ns = wall_ns()
        self._lost = False

    def on_cmd_vel(self, _: Twist) -> None:
        """Remember when the last message was received."""
        self._received_ns = wall_ns()

    @every(hz=2)
    def publish_state(self) -> None:
        """Publish the state of the link."""
        silence = (wall_ns() - self._received_ns) / 1e9
        lost = silence > LINK_TIMEOUT
        self.link.publish(String(f"No message from the robot for {silence:.0f} s." if lost else ""))
        if lost != self._lost:
            self.notice.publish(
                String("Connection to the robot lost." if lost else "Connection to the robot restored.")
            )
        self._lost = lost
