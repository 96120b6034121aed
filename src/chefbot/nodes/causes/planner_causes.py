"""Why a plan leads elsewhere than the one before, or why there is none: the cells in the way."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chefbot.causes.detours import SAME_GOAL, DetourDetector
from chefbot.causes.obstacles import CellCentre, blocked_index, nearest_lethal
from chefbot.causes.reports import DETOUR, FAILURE, make_report
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Quantity
from chefbot.nodes.causes.reports import CauseReportsNode, marked_place
from chefbot.nodes.global_costmap import GlobalCostmapNode
from chefbot.planning.planner import Planner, PlanningError, PlanningFailure


class PlannerCausesNode(GlobalCostmapNode, CauseReportsNode):
    """Base class of a node that plans on the global costmap and reports detours and failures."""

    _taken_goal: tuple[SE2, SE2] | None = None

    @cached_property
    def _detours(self) -> DetourDetector:
        return DetourDetector()

    def report_plan(self, plan: NDArray[np.float64], goal: SE2, robot: SE2) -> None:
        """Report that a plan (n, 3) is a detour, if it is one, and the obstacle on the plan before."""
        costs = self._costs.update()
        detour = self._detours.process(plan, goal, robot, costs)
        if detour is None:
            return
        place = marked_place(self._costs, detour.obstacle, "map", self.robot)
        numbers = (
            Quantity("deviation", detour.deviation, "m"),
            Quantity("extra length", detour.extra_length, "m"),
        )
        sentence = f"The new plan leads {detour.deviation:.1f} m from the old one, which is blocked."
        self.report_once(make_report(DETOUR, "global plan", sentence, place, numbers))

    def report_taken_goal(self, plan: NDArray[np.float64], goal: SE2) -> str:
        """Report that a plan (n, 3) ends beside its goal, which is taken; return the sentence, empty if it does not.

        It is reported once for a goal and the pose beside it.
        """
        end = SE2.of(plan[-1])
        away = end.distance(goal)
        if away <= SAME_GOAL:
            self._taken_goal = None
            return ""
        sentence = f"The goal is taken: the robot drives to a free pose with sight of it, {away:.2f} m away."
        if self._taken_goal != (goal, end):
            self._taken_goal = goal, end
            cell = nearest_lethal(self._costs.update(), goal.x, goal.y)
            place = marked_place(self._costs, cell, "map", self.robot)
            numbers = (Quantity("distance from the goal", away, "m"),)
            self.report_once(make_report(DETOUR, "goal taken", sentence, place, numbers))
        return sentence

    def report_failure(self, error: PlanningError, planner: Planner, start: SE2, goal: SE2) -> None:
        """Report that there is no plan, and the obstacle that closes the way or covers the goal."""
        costs = self._costs.update()
        at = goal if error.failure is PlanningFailure.GOAL_OCCUPIED else start
        cell = nearest_lethal(costs, at.x, at.y)
        if error.failure is PlanningFailure.NO_VALID_PATH:
            cell = self._closing_cell(planner, costs, start, goal)
        elif error.failure not in (PlanningFailure.GOAL_OCCUPIED, PlanningFailure.START_OCCUPIED):
            cell = None
        place = marked_place(self._costs, cell, "map", self.robot)
        sentence = f"{str(error)[0].upper()}{str(error)[1:]}."
        self.report_once(make_report(FAILURE, "global plan", sentence, place))

    def _closing_cell(self, planner: Planner, costs: Costmap, start: SE2, goal: SE2) -> CellCentre | None:
        """Return the first obstacle on the way that the static map alone leaves, None if it leaves none."""
        try:
            way = planner.plan(self._costs.static_costs(), start, goal)
        except PlanningError:
            return None
        blocked = blocked_index(costs, way)
        return (
            None if blocked is None else nearest_lethal(costs, float(way[blocked, 0]), float(way[blocked, 1]))
        )
