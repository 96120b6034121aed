"""Why the base moves less than commanded: as a sentence, and as the report of a cause."""

from __future__ import annotations

import numpy as np

from chefbot.causes.reports import SLOW, STOP, MarkedPlace, make_report
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Quantity
from chefbot.msgs.std_msgs import String
from chefbot.nodes.causes.reports import CauseReportsNode
from chefbot.runtime.node import Out, topic
from chefbot.safety.collision_monitor import CheckedTwist
from chefbot.safety.monitor_text import STOPPED_SHARE, ReasonKeeper, SensedPoint

NOTABLE_FRACTION = 0.9
"""Fraction of the commanded motion from which less is not a slow-down worth a report."""
MONITOR, CONDITION = "collision monitor", "sensor data"
"""Checks: an obstacle or unseen ground on the path of the twist; a fault of a sensor."""


class MotionReasonsNode(CauseReportsNode):
    """Base class of the node that commands the wheels: it publishes why they get less than was commanded.

    The reason is published on `collision_monitor/reason`, empty for none, and reported as a cause.
    """

    reason: Out[String] = topic("collision_monitor/reason", latched=True)

    def start(self) -> None:
        """Start with no reason for limited motion."""
        self._reasons = ReasonKeeper()

    def explain(self, sentence: str) -> None:
        """Publish why the wheels get less than was commanded, a sentence, or empty for nothing."""
        if self._reasons.changes(sentence, self.now_ns):
            self.reason.publish(String(sentence))

    def report_limit(
        self,
        commanded: tuple[float, float],
        left: tuple[float, float],
        checked: CheckedTwist,
        fault: str,
        pose: SE2 | None,
        refusal: str = "",
    ) -> None:
        """Report what limits a commanded twist (m/s, rad/s) to what is left of it, if anything does.

        fault: of a sensor, a sentence, or empty. pose: of the robot in odom. refusal: why an operator's commands do
        not count, a sentence, or empty.
        """
        amount = abs(commanded[0]) + abs(commanded[1])
        if refusal and not amount:
            self.report("motion", make_report(STOP, CONDITION, fault or refusal))
            return
        fraction = min(1.0, (abs(left[0]) + abs(left[1])) / amount) if amount else 1.0
        limited = checked.fraction < NOTABLE_FRACTION
        if fraction >= NOTABLE_FRACTION or not (fault or limited):
            self.report("motion", None)
            return
        numbers = (Quantity("fraction of the commanded motion", fraction, ""),)
        kind = STOP if fraction < STOPPED_SHARE else SLOW
        if fault:
            self.report("motion", make_report(kind, CONDITION, fault, numbers=numbers))
            return
        place = None
        if checked.point is not None and pose is not None:
            place = _place(checked.point, pose, self.now_ns)
        sentence = f"{checked.limit[0].upper()}{checked.limit[1:]}."
        self.report("motion", make_report(kind, MONITOR, sentence, place, numbers))


def _place(point: SensedPoint, pose: SE2, now_ns: int) -> MarkedPlace:
    x, y = pose.apply(np.array([[point.x, point.y]]))[0].tolist()
    return MarkedPlace(point.sensor, "odom", x, y, now_ns - round(point.age * 1e9))
