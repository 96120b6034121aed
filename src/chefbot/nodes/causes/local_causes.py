"""Why the controller waits, slows down, brakes, or deviates from the path: the cells that are in the way."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.behavior.behavior import BehaviorProgress
from chefbot.causes.obstacles import (
    CellCentre,
    blocked_index,
    deviation,
    in_the_way,
    nearest_lethal,
    remaining,
)
from chefbot.causes.reports import DETOUR, SLOW, STOP, TRACKER, MarkedPlace, make_report
from chefbot.control.controller import ControllerStatus
from chefbot.control.path_follower import FollowPathError, PathFollower, PathStep
from chefbot.control.people_cost import costliest_person
from chefbot.control.trajectory import TIME_STEP
from chefbot.maths.costs import UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause, LocalizationStatus, Quantity
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.nodes.causes.reports import CauseReportsNode, marked_place
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import In
from chefbot.safety.speed_limit import fraction_within, too_slow_reason

SLOW_FRACTION = 0.6
"""Fraction of the speed that the distance to the goal allows below which the controller drives slowly."""
SLOW_DELAY_NS = 500_000_000
"""Time for which it must drive slowly before that is reported, ns: it begins and turns slowly, too."""
NOTABLE_COST = 100
"""Cost on the chosen trajectory from which an obstacle beside it is what slows the robot down."""
NOTABLE_PERSON = 0.25
"""Cost of a person on the chosen trajectory from which that person is what slows the robot down."""
NOTABLE_DEVIATION = 0.15
"""Distance of the local path from the given one from which it is a detour, m: three cells."""
TRAJECTORY = 1.5
"""Duration of the trajectory on which obstacles slow the robot down, s."""


class LocalCausesNode(LocalCostmapNode, CauseReportsNode):
    """Base class of a node that drives by the local costmap and reports what in it stops or slows the robot."""

    localization_status: In[LocalizationStatus]
    speed_limit: In[SpeedLimit]

    @property
    def _too_slow(self) -> str:
        """Why the speed limit makes the robot stand; empty if it does not."""
        return too_slow_reason(self.speed_limit.last, Limits.of(self.robot).speed)

    def report_waiting(self, reason: str) -> None:
        """Report that the robot stands because of a sensor, of localization or of a speed limit, a sentence."""
        check = "speed limit" if reason == self._too_slow else "sensor data"
        if reason.startswith("Localization"):
            check = "localization"
        status = self.localization_status.last if check == "localization" else None
        numbers = () if status is None else (
            Quantity("probability", status.probability, ""), Quantity("std_xy", status.std_xy, "m")
        )  # fmt: skip
        self.report("motion", make_report(STOP, check, f"The controller waits: {reason}", numbers=numbers))

    def report_motion(self, progress: BehaviorProgress, pose: SE2, costs: Costmap, blind: str) -> None:
        """Report what blocks a motion of a behavior, such as backing up."""
        if progress is not BehaviorProgress.BLOCKED:
            self.report("motion", None)
            return
        place = None if blind else self._place(nearest_lethal(costs, pose.x, pose.y))
        sentence = f"A recovery motion is blocked. {blind}".rstrip()
        self.report_once(make_report(STOP, "motion of a behavior", sentence, place))

    def report_step(
        self, step: PathStep, follower: PathFollower, pose: SE2, costs: Costmap, blind: str
    ) -> None:
        """Report what a cycle of path following met: nothing admissible, slow driving, a blocked path."""
        if step.result is not None and step.result.error_code == FollowPathError.STUCK:
            self.report_once(make_report(STOP, "progress", step.result.error_msg))
        blocked = step.status is ControllerStatus.BLOCKED or bool(blind and step.speed > 0.0)
        found = self._blocked(follower, pose, costs, blind) if blocked else None
        slow = None if blocked else self._slow(step, follower, pose, costs)
        self.report("motion", found or slow, 0 if blocked else SLOW_DELAY_NS)
        self.report("path", self._detour(follower, pose, costs))

    def _blocked(self, follower: PathFollower, pose: SE2, costs: Costmap, blind: str) -> Cause:
        if blind:
            return make_report(STOP, "sensor data", blind)
        place = self._place(in_the_way(costs, follower.path, pose))
        return make_report(STOP, "admissible twists", "The controller has no collision-free command.", place)

    def _slow(self, step: PathStep, follower: PathFollower, pose: SE2, costs: Costmap) -> Cause | None:
        """Return the obstacle beside the chosen trajectory if the robot drives slowly past it."""
        limits = Limits.of(self.robot)
        to_goal = math.sqrt(limits.acceleration * pose.distance(SE2.of(follower.path[-1])))
        fast = min(limits.speed, to_goal)
        fast *= fraction_within(self.speed_limit.last, fast, limits.speed)
        if not 0.02 < step.v < SLOW_FRACTION * fast:
            return None
        trajectory = follower.trajectory(limits, TRAJECTORY)
        if trajectory is None or not len(trajectory):
            return None
        person = self._slow_near_person(step, trajectory, fast)
        if person is not None:
            return person
        values = costs.values(trajectory[:, 0], trajectory[:, 1], outside=0)
        values = np.where(values == UNKNOWN, 0, values)
        worst = int(np.argmax(values))
        if values[worst] < NOTABLE_COST:
            return None
        x, y = float(trajectory[worst, 0]), float(trajectory[worst, 1])
        place = self._place(nearest_lethal(costs, x, y))
        numbers = (Quantity("speed", step.v, "m/s"), Quantity("possible speed", fast, "m/s"))
        sentence = f"The controller drives at {step.v:.2f} m/s past an obstacle."
        return make_report(SLOW, "speed near obstacles", sentence, place, numbers)

    def _slow_near_person(self, step: PathStep, trajectory: NDArray[np.float64], fast: float) -> Cause | None:
        """Return the person near whom the chosen trajectory (n, 3) leads, if there is one."""
        people = self._nearby_people()
        row, cost = costliest_person(people, trajectory, TIME_STEP)
        if cost < NOTABLE_PERSON:
            return None
        x, y = people.states[row, :2].tolist()
        place = MarkedPlace(TRACKER, self.fixed_frame, x, y, self.now_ns)
        numbers = (Quantity("speed", step.v, "m/s"), Quantity("possible speed", fast, "m/s"))
        sentence = f"The controller drives at {step.v:.2f} m/s near a person."
        return make_report(SLOW, "speed near people", sentence, place, numbers)

    def _detour(self, follower: PathFollower, pose: SE2, costs: Costmap) -> Cause | None:
        """Return the obstacle on the given path if the local path leads around it."""
        if follower.path is follower.given_path:
            return None
        away = deviation(follower.path, follower.given_path, pose)
        given = remaining(follower.given_path, pose)
        first = blocked_index(costs, given)
        if away < NOTABLE_DEVIATION or first is None:
            return None
        place = self._place(nearest_lethal(costs, float(given[first, 0]), float(given[first, 1])))
        sentence = f"The controller deviates {away:.2f} m from the path."
        return make_report(DETOUR, "local path", sentence, place, (Quantity("deviation", away, "m"),))

    def _place(self, cell: CellCentre | None) -> MarkedPlace | None:
        return marked_place(self._costs, cell, "odom", self.robot)
