"""The planner server: global costmap and path planning."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.conversions import costmap_message, mark_laser, mark_obstacles
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import LIVE_PARAMS, CostmapParams
from chefbot.costmap.pose_jump import PoseJumpDetector
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.nav2_msgs import ComputePathToPose, ComputePathToPose_Goal, ComputePathToPose_Result
from chefbot.msgs.nav_msgs import OccupancyGrid, Path
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.planning.global_planning import ERROR_CODES, NO_TRANSFORM, RETRY_WITHOUT_FAR_MARKS
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import Planner, PlanningError
from chefbot.robot.scan_plane import plane_of
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.runtime.plugins import load_plugin
from chefbot.runtime.transform_buffer import TransformError


class PlannerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the global costmap and of the planner plugin."""

    costmap: CostmapParams = CostmapParams()
    plugin: str = ""
    """`pkg.module:Class` of a custom planner; its constructor receives `settings`."""
    settings: PlannerParams = PlannerParams()


class PlannerNode(Node):
    """Serves compute_path_to_pose on the static map and the obstacle layers."""

    live_params = (*(f"costmap.{name}" for name in LIVE_PARAMS), "settings.*")
    params: PlannerNodeParams
    map: In[OccupancyGrid]
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    clear_costmaps: In[Float64]
    compute_path_to_pose = action_server(ComputePathToPose)
    plan: Out[Path]
    costmap: Out[OccupancyGrid] = topic("global_costmap/costmap", latched=True)

    def start(self) -> None:
        """Create the global costmap and the planner; planning fails before the first map."""
        self._costs = LayeredCostmap(
            self.params.costmap,
            self.robot.footprint,
            avoid_unknown=self.robot.sensors.forward_sensing_only,
        )
        self._pose_jump = PoseJumpDetector()
        self._planner = self._make_planner()

    def reconfigure(self, params: PlannerNodeParams) -> None:
        """Apply new parameters from the next plan on."""
        self.params = params
        self._costs.reconfigure(params.costmap)
        self._planner = self._make_planner()

    def _make_planner(self) -> Planner:
        planner: Planner = load_plugin(self.params.plugin, GridPlanner, self.params.settings)
        return planner

    def on_map(self, message: OccupancyGrid) -> None:
        """Set a new or grown static map."""
        self._costs.set_static(message.grid)

    def on_scan(self, scan: LaserScan) -> None:
        """Update the laser's obstacle layer with a scan."""
        stamp = scan.header.stamp.ns
        mark = partial(mark_laser, scan=scan)
        self.tf.on_available("odom", scan.header.frame_id, stamp, lambda pose: self._mark(mark, pose))

    def on_obstacles(self, scan: ObstacleScan) -> None:
        """Update the camera's obstacle layers with an obstacle scan."""
        stamp = scan.header.stamp.ns
        mark = partial(mark_obstacles, scan=scan, plane=plane_of(self.robot))
        self.tf.on_available("odom", scan.header.frame_id, stamp, lambda pose: self._mark(mark, pose))

    def _mark(self, mark: Callable[[LayeredCostmap, SE2], None], odom_T_sensor: SE2) -> None:
        """Mark with the odometry pose at the time of the measurement and the latest map -> odom transform."""
        try:
            map_T_odom = self.tf.lookup("map", "odom")
        except TransformError:
            return  # not localized yet: marks would be in the wrong place
        if self.map.last is not None:
            if self._pose_jump.process(map_T_odom, odom_T_sensor):
                self._costs.clear()
            mark(self._costs, map_T_odom @ odom_T_sensor)

    def on_clear_costmaps(self, radius: Float64) -> None:
        """Clear the marks within a radius (m) of the robot."""
        try:
            self._costs.clear_around(self.tf.lookup("map", "base_link"), radius.data)
        except TransformError:
            self._costs.clear()  # not localized: all marks are unreliable

    async def on_compute_path_to_pose(self, goal: ComputePathToPose_Goal, _: Any) -> ComputePathToPose_Result:
        """Return a path from the robot's pose (or from `start`) to the goal, or an error code and message."""
        try:
            robot = self.tf.lookup("map", "base_link")
        except TransformError as error:
            return ComputePathToPose_Result(error_code=NO_TRANSFORM, error_msg=f"Not localized yet: {error}")
        start = goal.start.pose.se2 if goal.use_start else robot
        self._costs.clear_footprint(robot)
        try:
            poses = self._find_path(robot, start, goal.goal.pose.se2)
        except PlanningError as error:
            code = ERROR_CODES[error.failure]
            return ComputePathToPose_Result(error_code=code, error_msg=str(error))
        path = Path.of(Header.of(self.now_ns, "map"), poses)
        self.plan.publish(path)
        return ComputePathToPose_Result(path)

    def _find_path(self, robot: SE2, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Plan around all marks and, if that fails, without those out of sensor range, which may have left.

        Marks that are too far away to be seen again count as long as there is another path. Raises PlanningError.
        """
        try:
            return self._planner.plan(self._costs.update(), start, goal)
        except PlanningError as error:
            if error.failure not in RETRY_WITHOUT_FAR_MARKS:
                raise
            return self._planner.plan(self._costs.costs_without_far_marks(robot), start, goal)

    @every(hz=1)
    def publish_costmap(self) -> None:
        """Publish the global costmap for display."""
        if self.map.last is not None:
            header = Header.of(self.now_ns, "map")
            self.costmap.publish(costmap_message(header, self._costs.update()))
