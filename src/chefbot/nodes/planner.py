"""The global costmap and the planner on it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.conversions import costmap_message, mark_laser, mark_obstacles, plane_of
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import LIVE, CostmapParams
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose, ComputePathToPose_Goal, ComputePathToPose_Result
from chefbot.msgs.nav_msgs import OccupancyGrid, Path
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import Failure, Planner, PlanningError
from chefbot.runtime.actions import serves
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.runtime.plugins import plugin
from chefbot.runtime.transform_buffer import TransformError

ERROR_CODES = {
    Failure.START_OUTSIDE_MAP: 203,
    Failure.GOAL_OUTSIDE_MAP: 204,
    Failure.START_OCCUPIED: 205,
    Failure.GOAL_OCCUPIED: 206,
    Failure.NO_VALID_PATH: 208,
}
"""As in nav2_msgs/action/ComputePathToPose."""
NO_TRANSFORM = 202
MAY_HAVE_LEFT = (Failure.NO_VALID_PATH, Failure.GOAL_OCCUPIED)
"""For want of a way that a thing out of sight may block no longer."""
JUMP_DISTANCE, JUMP_ANGLE = 0.5, 0.26
"""Metres and radians (15 degrees) by which the robot finds itself elsewhere than it believed when it saw things."""


class PlannerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The map of costs, and which planner with which settings."""

    costmap: CostmapParams = CostmapParams()
    plugin: str = ""
    """`pkg.module:Class` of another planner; it is made with `settings`."""
    settings: PlannerParams = PlannerParams()


class PlannerNode(Node):
    """Serves compute_path_to_pose on the map, with what the sensors have seen since."""

    live_params = (*(f"costmap.{name}" for name in LIVE), "settings.*")
    params: PlannerNodeParams
    map: In[OccupancyGrid]
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    clear_costmaps: In[Float64]
    compute_path_to_pose = serves(ComputePathToPose)
    plan: Out[Path]
    costmap: Out[OccupancyGrid] = topic("global_costmap/costmap", latched=True)

    def start(self) -> None:
        """Nothing can be planned before the first map."""
        self._costs = LayeredCostmap(
            self.params.costmap, self.robot.footprint_radius, wary=self.robot.sensors.look_ahead_only
        )
        self._seen_from: SE2 | None = None
        self._planner = self._make_planner()

    def reconfigure(self, params: PlannerNodeParams) -> None:
        """From the next plan on."""
        self.params = params
        self._costs.retune(params.costmap)
        self._planner = self._make_planner()

    def _make_planner(self) -> Planner:
        made: Planner = plugin(self.params.plugin, GridPlanner, self.params.settings)
        return made

    def on_map(self, message: OccupancyGrid) -> None:
        """A new or grown map."""
        self._costs.set_static(message.grid)

    def on_scan(self, scan: LaserScan) -> None:
        """What is there now and was not on the map."""
        stamp = scan.header.stamp.ns
        mark = partial(mark_laser, scan=scan)
        self.tf.when("odom", scan.header.frame_id, stamp, lambda pose: self._mark(mark, pose))

    def on_obstacles(self, seen: ObstacleScan) -> None:
        """What the camera sees at any height."""
        stamp = seen.header.stamp.ns
        mark = partial(mark_obstacles, seen=seen, plane=plane_of(self.robot))
        self.tf.when("odom", seen.header.frame_id, stamp, lambda pose: self._mark(mark, pose))

    def _mark(self, mark: Callable[[LayeredCostmap, SE2], None], odom_T_sensor: SE2) -> None:
        """Odometry's time is the sensor's; the map's correction is the newest known."""
        try:
            map_T_odom = self.tf.lookup("map", "odom")
        except TransformError:
            return  # not localized yet: it would stand in the wrong place
        if self.map.last is not None:
            self._forget_if_elsewhere(map_T_odom, odom_T_sensor)
            mark(self._costs, map_T_odom @ odom_T_sensor)

    def _forget_if_elsewhere(self, map_T_odom: SE2, odom_T_sensor: SE2) -> None:
        """Found after being lost, carried, or a loop closed: what was seen before stands in wrong places."""
        if self._seen_from is not None:
            jump = (self._seen_from @ odom_T_sensor).between(map_T_odom @ odom_T_sensor)
            if math.hypot(jump.x, jump.y) < JUMP_DISTANCE and abs(jump.yaw) < JUMP_ANGLE:
                return
            self._costs.clear()
        self._seen_from = map_T_odom

    def on_clear_costmaps(self, radius: Float64) -> None:
        """Forget what was seen within so many metres of the robot."""
        try:
            self._costs.clear_around(self.tf.lookup("map", "base_link"), radius.data)
        except TransformError:
            self._costs.clear()  # it does not know where it is: nothing seen is worth keeping

    async def on_compute_path_to_pose(self, goal: ComputePathToPose_Goal, _: Any) -> ComputePathToPose_Result:
        """A path from where the robot is (or from `start`) to the goal, or the reason why not."""
        try:
            here = self.tf.lookup("map", "base_link")
        except TransformError as error:
            return ComputePathToPose_Result(error_code=NO_TRANSFORM, error_msg=f"Not localized yet: {error}")
        start = goal.start.pose.se2 if goal.use_start else here
        try:
            poses = self._find_path(here, start, goal.goal.pose.se2)
        except PlanningError as error:
            code = ERROR_CODES[error.failure]
            return ComputePathToPose_Result(error_code=code, error_msg=str(error))
        path = self._path(poses)
        self.plan.publish(path)
        return ComputePathToPose_Result(path)

    def _find_path(self, here: SE2, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Round all that was seen; if there is no way, to where somebody stood who may have left.

        What stands too far away to be seen again is believed as long as there is another way. PlanningError.
        """
        try:
            return self._planner.plan(self._costs.update(), start, goal)
        except PlanningError as error:
            if error.failure not in MAY_HAVE_LEFT:
                raise
            return self._planner.plan(self._costs.without_far_marks(here), start, goal)

    def _path(self, poses: NDArray[np.float64]) -> Path:
        header = Header.of(self.now_ns, "map")
        return Path(header, tuple(PoseStamped(header, Pose.of(SE2.of(pose))) for pose in poses))

    @every(hz=1)
    def publish_costmap(self) -> None:
        """For looking."""
        if self.map.last is not None:
            header = Header.of(self.now_ns, "map")
            self.costmap.publish(costmap_message(header, self._costs.update()))
