"""Why a plan leads elsewhere than the one before, or why there is none: the cells in the way."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chefbot.causes.detours import MIN_DEVIATION, SAME_GOAL_DISTANCE, DetourDetector, NewGoals
from chefbot.causes.obstacles import CellCentre, blocked_index, nearest_lethal, opposed_lane
from chefbot.causes.reports import DETOUR, FAILURE, MAP, MarkedPlace, is_zone, make_report
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Quantity
from chefbot.nodes.causes.reports import CauseReportsNode, marked_place
from chefbot.nodes.global_costmap import GlobalCostmapNode
from chefbot.planning.grid_planner import path_length
from chefbot.planning.planner import Planner, PlanningError, PlanningFailure

SAME_END_DISTANCE = 0.25
"""Distance up to which two poses beside an occupied goal are the same one in reports, m."""


class PlannerCausesNode(GlobalCostmapNode, CauseReportsNode):
    """Base class of a node that plans on the global costmap and reports detours and failures."""

    _occupied_goal: tuple[SE2, SE2] | None = None

    @cached_property
    def _zone_detours(self) -> NewGoals:
        return NewGoals()

    @cached_property
    def _detours(self) -> DetourDetector:
        return DetourDetector()

    def report_plan(self, plan: NDArray[np.float64], planner: Planner, goal: SE2, robot: SE2) -> None:
        """Report that a plan (n, 3) is a detour, if it is one, and the zone or the obstacle on the plan before."""
        costs = self._costs.update()
        if self._zone_detours.is_new(goal) and self.zones.last is not None and self.zones.last.zones:
            self._report_zone_detour(plan, planner, costs, robot, goal)
        detour = self._detours.process(plan, goal, robot, costs)
        if detour is None:
            return
        place = marked_place(self._costs, detour.obstacle, "map", self.robot)
        numbers = (
            Quantity("deviation", detour.deviation, "m"),
            Quantity("extra length", detour.extra_length, "m"),
        )
        sentence = f"The new plan deviates {detour.deviation:.1f} m from the old one, which is blocked."
        self.report_once(make_report(DETOUR, "global plan", sentence, place, numbers))

    def report_occupied_goal(self, plan: NDArray[np.float64], goal: SE2) -> str:
        """Report that a plan (n, 3) ends beside its occupied goal; return the sentence, empty if it does not.

        It is reported once for a goal and the pose beside it, which shifts with each look at the obstacle.
        """
        end = SE2.of(plan[-1])
        away = end.distance(goal)
        if away <= SAME_GOAL_DISTANCE:
            self._occupied_goal = None
            return ""
        sentence = (
            f"The goal is occupied: the robot drives to a free pose with sight of it, {away:.2f} m away."
        )
        before = self._occupied_goal
        if before is None or before[0] != goal or before[1].distance(end) > SAME_END_DISTANCE:
            self._occupied_goal = goal, end
            cell = nearest_lethal(self._costs.update(), goal.x, goal.y)
            place = marked_place(self._costs, cell, "map", self.robot)
            numbers = (Quantity("distance from the goal", away, "m"),)
            self.report_once(make_report(DETOUR, "goal occupied", sentence, place, numbers))
        return sentence

    def report_failure(self, error: PlanningError, planner: Planner, start: SE2, goal: SE2) -> str:
        """Report that there is no plan, and what closes the path or covers the goal; return the reason."""
        costs = self._costs.update()
        at = goal if error.failure is PlanningFailure.GOAL_OCCUPIED else start
        cell, lane = nearest_lethal(costs, at.x, at.y), ""
        if error.failure is PlanningFailure.NO_VALID_PATH:
            path = self._path_on_map(planner, start, goal)
            cell, lane = _first_obstacle(costs, path), opposed_lane(costs, path)
        elif error.failure not in (PlanningFailure.GOAL_OCCUPIED, PlanningFailure.START_OCCUPIED):
            cell = None
        place = marked_place(self._costs, cell, "map", self.robot)
        because = "" if error.failure is PlanningFailure.START_OCCUPIED else _because(place, lane)
        reason = f"{error}{because}"
        self.report_once(make_report(FAILURE, "global plan", f"{reason[0].upper()}{reason[1:]}.", place))
        return reason

    def _report_zone_detour(
        self, plan: NDArray[np.float64], planner: Planner, costs: Costmap, robot: SE2, goal: SE2
    ) -> None:
        """Report a zone that lies on the path that the static map alone leaves, if the plan is longer."""
        path = self._path_on_map(planner, robot, goal)
        extra = path_length(plan) - path_length(path)
        place = marked_place(self._costs, _first_obstacle(costs, path), "map", self.robot)
        if not len(path) or extra < MIN_DEVIATION:
            return
        place = place if place is not None and is_zone(place.sensor) else None
        lane = opposed_lane(costs, path)
        if place is None and not lane:
            return
        title = lane if place is None else place.sensor
        sentence = f"The plan is {extra:.1f} m longer because of the {title}."
        numbers = (Quantity("extra length", extra, "m"),)
        self.report_once(make_report(DETOUR, "global plan", sentence, place, numbers))

    def _path_on_map(self, planner: Planner, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Return the path (n, 3) that the static map alone leaves, without a pose if it leaves none."""
        try:
            return planner.plan(self._costs.static_costs(), start, goal)
        except PlanningError:
            return np.zeros((0, 3))


def _because(place: MarkedPlace | None, lane: str) -> str:
    """Return what closes the path or covers the goal as the end of a sentence; empty for a wall of the map."""
    if place is None:
        return f" because of the {lane}" if lane else ""
    if place.sensor == MAP:
        return ""
    return f" because of the {place.sensor}" if is_zone(place.sensor) else " because of an obstacle"


def _first_obstacle(costs: Costmap, path: NDArray[np.float64]) -> CellCentre | None:
    """Return the first obstacle on a path (n, 3), None if there is none."""
    blocked = blocked_index(costs, path) if len(path) else None
    return (
        None if blocked is None else nearest_lethal(costs, float(path[blocked, 0]), float(path[blocked, 1]))
    )
