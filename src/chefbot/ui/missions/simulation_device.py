"""Base of the web UI's device: what its operator can change in a simulated world."""

from __future__ import annotations

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.node import Out, topic
from chefbot.ui import commands as do
from chefbot.ui.missions.cause_device import CauseDevice


class SimulationDevice(CauseDevice):
    """Publishes the operator's requests to add boxes, move doors and carry the robot away."""

    drop_box: Out[PoseStamped] = topic("simulation/drop_box")
    door: Out[String] = topic("simulation/door")
    kidnap: Out[PoseStamped] = topic("simulation/kidnap")

    def _execute_in_simulation(self, command: do.DropBox | do.Kidnap | do.OpenDoor | do.CloseDoor) -> None:
        match command:
            case do.DropBox(x, y):
                self.drop_box.publish(self._stamped(SE2(x, y, 0.0)))
            case do.Kidnap(x, y, yaw):
                self.kidnap.publish(self._stamped(SE2(x, y, yaw)))
            case do.OpenDoor(name):
                self.door.publish(String(f"open {name}"))
            case do.CloseDoor(name):
                self.door.publish(String(f"close {name}"))

    def _stamped(self, pose: SE2) -> PoseStamped:
        return PoseStamped(Header.of(self.now_ns, "map"), Pose.of(pose))
