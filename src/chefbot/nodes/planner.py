"""The planner server: global costmap and path planning."""

from __future__ import annotations

import contextlib
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.params import GLOBAL_COSTMAP, CostmapParams
from chefbot.costmap.sources import DROP_OFFS
from chefbot.maths.se2 import SE2
from chefbot.msgs.nav2_msgs import ComputePathToPose, ComputePathToPose_Goal, ComputePathToPose_Result
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.navigation.blockage_finder import BlockageFinderNode
from chefbot.nodes.navigation.goal_pose import GoalError, goal_in_map
from chefbot.nodes.navigation.narrow_passages import fits_narrow_passages, narrow_map_costs
from chefbot.planning.closed_routes import ClosedRoutes
from chefbot.planning.global_planning import (
    ERROR_CODES,
    NO_TRANSFORM,
    RETRY_THROUGH_NARROW_PASSAGES,
)
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.narrow_passages import is_map_narrow
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import Planner, PlanningError, checked_path
from chefbot.planning.route_hysteresis import RouteHysteresis
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Out
from chefbot.runtime.plugins import load_plugin
from chefbot.runtime.transform_buffer import TransformError

FIRST_POSE_TIMEOUT, FIRST_POSE_PERIOD = 6.0, 0.2
"""Time for which the first pose on the map is awaited, shorter than a client's patience, and between two looks, s."""
NO_POSE = "The robot is not localized yet: it has no pose on the map."


class PlannerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the global costmap and of the planner plugin."""

    costmap: CostmapParams = GLOBAL_COSTMAP
    plugin: str = ""
    """`pkg.module:Class` of a custom planner; its constructor receives `settings`."""
    settings: PlannerParams = PlannerParams()


class PlannerNode(BlockageFinderNode):
    """Serves compute_path_to_pose on the static map and the obstacle layers."""

    live_params = (*BlockageFinderNode.live_params, "settings.*")
    params: PlannerNodeParams
    compute_path_to_pose = action_server(ComputePathToPose)
    plan: Out[Path]

    def start(self) -> None:
        """Create the global costmap and the planner; planning fails before the first map."""
        super().start()
        self._planner = self._make_planner()
        self._routes, self._closed = RouteHysteresis(), ClosedRoutes()

    def reconfigure(self, params: PlannerNodeParams) -> None:
        """Apply new parameters from the next plan on."""
        super().reconfigure(params)
        self._planner = self._make_planner()

    def _make_planner(self) -> Planner:
        planner: Planner = load_plugin(self.params.plugin, GridPlanner, self.params.settings, Planner)
        if isinstance(planner, GridPlanner):
            planner.walls = lambda: self._costs.static_costs()
        return planner

    async def on_compute_path_to_pose(self, goal: ComputePathToPose_Goal, _: Any) -> ComputePathToPose_Result:
        """Return a path from the robot's pose (or from `start`) to the goal, or an error code and message."""
        robot = await self._first_pose()
        if robot is None:
            return ComputePathToPose_Result(error_code=NO_TRANSFORM, error_msg=NO_POSE)
        try:
            start = goal_in_map(goal.start, self.tf).pose.se2 if goal.use_start else robot
            target = goal_in_map(goal.goal, self.tf).pose.se2
        except GoalError as error:
            return ComputePathToPose_Result(error_code=error.code, error_msg=str(error))
        self._costs.clear_footprint(robot, keep=(DROP_OFFS,))
        try:
            poses = checked_path(self._find_path(robot, start, target), self.params.plugin)
        except PlanningError as error:
            code = ERROR_CODES[error.failure]
            reason = self.report_failure(error, self._planner, start, target)
            return ComputePathToPose_Result(error_code=code, error_msg=reason)
        path = Path.of(Header.of(self.now_ns, "map"), poses)
        self.plan.publish(path)
        self.report_plan(poses, self._planner, target, robot)
        return ComputePathToPose_Result(path, error_msg=self.report_occupied_goal(poses, target))

    async def _first_pose(self) -> SE2 | None:
        """Return the robot's pose in the map; None if there is none after a while.

        After a start localization needs a moment, and no recovery behavior.
        """
        until_ns = self.now_ns + round(FIRST_POSE_TIMEOUT * 1e9)
        while True:
            try:
                return self.tf.lookup("map", "base_link")
            except TransformError:
                if self.now_ns >= until_ns:
                    return None
            await self.sleep(FIRST_POSE_PERIOD)

    def _find_path(self, robot: SE2, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Plan around all marks or, if no other path is left, through narrow passages. Raises PlanningError."""
        try:
            return self._plan_around_marks(robot, start, goal)
        except PlanningError as error:
            if error.failure in RETRY_THROUGH_NARROW_PASSAGES and self._is_narrow(start, goal):
                with contextlib.suppress(PlanningError):
                    costs = narrow_map_costs(
                        self._costs, self._costs_without_marks(), self._people()[1], self.robot
                    )
                    return self._planner.plan(costs, start, goal)
            raise

    def _is_narrow(self, start: SE2, goal: SE2) -> bool:
        """Return whether the map has narrow passages only, or what closes its wide ones has stood there for long."""
        if not fits_narrow_passages(self.robot):
            return False
        standing = self._closed.is_standing(self.now_ns * 1e-9, goal)
        return standing or is_map_narrow(self._planner, self._costs_without_marks(), start, goal)

    def _plan_around_marks(self, robot: SE2, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Plan around all marks and, if that fails, without those out of sensor range, which may have left.

        Marks that are too far away to be seen again count as long as there is another path. Raises PlanningError.
        """
        routes = self._routes if start is robot else RouteHysteresis()
        return routes.plan(
            self.now_ns * 1e-9,
            robot,
            goal,
            around_all=lambda: self._planner.plan(self._costs.update(), start, goal),
            without_far=lambda: self._planner.plan(self._costs_without_far_marks(robot), start, goal),
        )
