"""Finds what blocks the path to a goal, and where to wait until it is gone."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.causes.obstacles import nearest_lethal
from chefbot.costmap.recent_poses import RecentPoses
from chefbot.maths.costs import INSCRIBED, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import FindBlockage, FindBlockage_Goal, FindBlockage_Result
from chefbot.msgs.chefbot_msgs.maps import MapZones
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.causes.planner_causes import PlannerCausesNode
from chefbot.nodes.causes.reports import marked_place
from chefbot.planning.blockage import Blockage, PathCosts, find_blockage
from chefbot.planning.global_planning import RETRY_WITHOUT_FAR_MARKS
from chefbot.planning.parking import ParkingSearch
from chefbot.planning.planner import Planner, PlanningError
from chefbot.planning.waiting_place import find_waiting_place
from chefbot.runtime.actions import action_server
from chefbot.runtime.transform_buffer import TransformError


class BlockageFinderNode(PlannerCausesNode):
    """Base class of a node that plans on the global costmap and finds what blocks a path.

    Its parameters have a field `settings` of type PlannerParams.
    """

    find_blockage = action_server(FindBlockage)
    _planner: Planner

    def start(self) -> None:
        """Start without a search; the first request creates it for the map."""
        super().start()
        self._search: tuple[OccupancyGrid, ParkingSearch] | None = None
        self._recent = RecentPoses()
        self._unmarked: tuple[OccupancyGrid, MapZones | None, tuple[bytes, ...], Costmap] | None = None

    def reconfigure(self, params: Any) -> None:
        """Apply new parameters from the next request on."""
        super().reconfigure(params)
        self._unmarked = None

    async def on_find_blockage(self, goal: FindBlockage_Goal, _: Any) -> FindBlockage_Result:
        """Return what blocks the path to the goal; nothing if the robot is not localized, or without a map."""
        try:
            robot = self.tf.lookup("map", "base_link")
        except TransformError:
            return FindBlockage_Result()
        if self.map.last is None:
            return FindBlockage_Result()
        numbers, places = self._people()
        radius, pose = self.robot.circumscribed_radius, goal.goal.pose.se2
        costs = PathCosts(self._present_costs(robot, pose), self._costs_without_marks())
        blockage = find_blockage(self._planner, costs, robot, pose, places, radius)
        if blockage is None:
            return self._occupied_goal_result(costs.marked, pose)
        found = self._result(blockage, numbers[list(blockage.people)], costs)
        if not goal.find_waiting_pose:
            return found
        waiting = find_waiting_place(self._parking_search(), self.params.settings, costs, robot, blockage)
        return msgspec.structs.replace(
            found,
            waiting_pose=PoseStamped(Header.of(self.now_ns, "map"), Pose.of(waiting.pose)),
        )

    def _present_costs(self, robot: SE2, goal: SE2) -> Costmap:
        """Return the costs that a plan to the goal is made on: without far marks if these close the path."""
        costs = self._costs.update()
        try:
            self._planner.plan(costs, robot, goal)
        except PlanningError as error:
            if error.failure in RETRY_WITHOUT_FAR_MARKS:
                return self._costs_without_far_marks(robot)
        return costs

    def _costs_without_far_marks(self, robot: SE2) -> Costmap:
        """Return the costs without marks that may have left since the robot was near.

        What it has just been near counts: else it would turn back to that as soon as it is out of sight.
        """
        return self._costs.costs_without_far_marks(self._recent.add(robot, self.now_ns * 1e-9))

    def _result(
        self, blockage: Blockage, numbers: NDArray[np.uint32], costs: PathCosts
    ) -> FindBlockage_Result:
        """Return the result with the marked cell."""
        where = SE2.of(blockage.free[blockage.blocked])
        cell = nearest_lethal(costs.marked, where.x, where.y)
        mark = marked_place(self._costs, cell, "map", self.robot)
        around = math.isfinite(blockage.length)
        return FindBlockage_Result(
            blocked=True,
            people=numbers,
            alternative_path=around,
            extra_length=blockage.length - blockage.free_length if around else 0.0,
            distance=blockage.distance,
            point=Point(*(cell or where[:2])),
            sensor="" if mark is None else mark.sensor,
            marked_at=Time.of(0 if mark is None else mark.marked_ns),
        )

    def _occupied_goal_result(self, costs: Costmap, goal: SE2) -> FindBlockage_Result:
        """Return the obstacle that occupies the goal at the end of a free path; nothing if none does."""
        occupied = INSCRIBED <= costs.at(goal.x, goal.y) < UNKNOWN
        cell = nearest_lethal(costs, goal.x, goal.y) if occupied else None
        mark = marked_place(self._costs, cell, "map", self.robot)
        if cell is None or mark is None:
            return FindBlockage_Result()
        return FindBlockage_Result(
            goal_occupied=True, point=Point(*cell), sensor=mark.sensor, marked_at=Time.of(mark.marked_ns)
        )

    def _costs_without_marks(self) -> Costmap:
        """Return the costs of the present map, its zones and what is as permanent, calculated when these change."""
        grid, zones, known = self.map.last, self.zones.last, self._unmarked
        assert grid is not None
        permanent = self._costs.permanent_cells()
        if known is not None and known[0] is grid and known[1] is zones and known[2] == permanent:
            return known[3]
        costs = self._costs.costs_without_marks()
        self._unmarked = grid, zones, permanent, costs
        return costs

    def _parking_search(self) -> ParkingSearch:
        """Return the search on the present map."""
        assert self.map.last is not None
        if self._search is None or self._search[0] is not self.map.last:
            self._search = self.map.last, ParkingSearch(self.map.last.grid, self.robot.circumscribed_radius)
        return self._search[1]
