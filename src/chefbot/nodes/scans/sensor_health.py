"""The health of the obstacle sensors: whether the robot may move, and whether it may drive forward."""

from __future__ import annotations

from typing import Any

from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.causes.base_fault import BaseFaultNode
from chefbot.runtime.node import In, Out, topic
from chefbot.safety.known_obstacles import MarkedCells
from chefbot.safety.obstacle_sensors import ObstacleSensors


class SensorHealthNode(BaseFaultNode):
    """Base class of a node that drives only while the obstacle sensors and the base have no fault.

    Its parameters have the field `optional_sensors`.
    """

    params: Any
    monitor_reason: In[String] = topic("collision_monitor/reason")
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Create the monitors of the sensors."""
        super().start()
        self._sensors = ObstacleSensors(self.robot, self.params.optional_sensors)

    def _sensor_fault(self, pose: SE2, costs: Costmap) -> str:
        """Return why the robot must stand still, by the monitors here or by those of the base; or an empty string."""
        return self._sensors.fault(self.now_ns, pose, MarkedCells(costs, pose)) or self._base_fault

    def _blind_ahead(self, pose: SE2, costs: Costmap) -> str:
        """Return why the robot must not drive forward, or an empty string."""
        return self._sensors.blind_ahead(MarkedCells(costs, pose))

    @property
    def _limit(self) -> str:
        """Why the collision monitor limits the motion; empty if it does not."""
        return self.monitor_reason.last.data if self.monitor_reason.last else ""

    def _publish_health(self, pose: SE2 | None, costs: Costmap) -> None:
        status = self._sensors.health(self.now_ns, pose, MarkedCells(costs, pose))
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))
