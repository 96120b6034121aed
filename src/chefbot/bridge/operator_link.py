"""Whether the robot is still heard by those who joined it from another machine."""

from __future__ import annotations

from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import String
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Device, In, NoParams, Out, every, topic

SILENCE = 1.0
"""Seconds without a word of the base, which tells 20 times a second what it commands: the link counts as cut."""


class LinkDevice(Device):
    """Says on `link` what is wrong, "" when nothing is; on `link/remark` when that changes.

    It counts the wall's seconds: where the robot's time is followed, that time stands while the link is cut.
    """

    params: NoParams
    cmd_vel: In[Twist]
    link: Out[String]
    remark: Out[String] = topic("link/remark")

    def start(self) -> None:
        """Nothing heard yet, and nothing missed."""
        self._heard_ns = wall_ns()
        self._lost = False

    def on_cmd_vel(self, _: Twist) -> None:
        """It is there."""
        self._heard_ns = wall_ns()

    @every(hz=2)
    def look(self) -> None:
        """Tell how long nothing was heard."""
        silent = (wall_ns() - self._heard_ns) / 1e9
        lost = silent > SILENCE
        self.link.publish(String(f"Nothing heard from the robot for {silent:.0f} s." if lost else ""))
        if lost != self._lost:
            self.remark.publish(
                String("Nothing is heard from the robot." if lost else "The robot is heard again.")
            )
        self._lost = lost
