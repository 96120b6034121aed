"""Autonomous exploration: drives to frontiers until no reachable one is left."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.exploration.explorer import ExplorationDecision, ExplorationGoal, Explorer
from chefbot.exploration.params import ExplorerParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, ExplorationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import (
    NavigateToPose,
    NavigateToPose_Goal,
    NavigateToPose_Result,
    Spin,
    Spin_Goal,
)
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import PlanningError
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Future, Task, wait_any
from chefbot.runtime.node import In, Node, Out, restored, topic
from chefbot.safety.emergency_stop import pressed_since

CHECK_PERIOD = 2.0
"""Period at which the frontier is checked on the growing map while driving, s."""
MAP_TIMEOUT = 2.5
"""Maximum time that the mapper takes to publish a new map, s."""
EMPTY_MAPS_TO_FINISH = 2
"""Consecutive maps without a frontier that end the exploration: the last scans may not be in the map yet."""


class ExplorerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of reachability and goal selection."""

    explorer: ExplorerParams = ExplorerParams()
    costmap: CostmapParams = CostmapParams()
    planner: PlannerParams = PlannerParams()
    go_home: Annotated[bool, Meta(description="whether to return to the start")] = True


class ExplorerNode(Node):
    """Sends the navigator from frontier to frontier; `exploration_status` reports progress and skipped frontiers."""

    live_params = ("go_home",)
    params: ExplorerNodeParams
    map: In[OccupancyGrid]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    restored_status: In[ExplorationStatus] = restored("exploration_status")
    restored_stop: In[EmergencyStopStatus] = restored("stop_status")
    navigate_to_pose = action_client(NavigateToPose)
    spin = action_client(Spin)
    exploration_status: Out[ExplorationStatus] = topic(latched=True)

    def start(self) -> None:
        """Start exploring with a full turn, also after a restart, with the map as it is."""
        self._explorer = Explorer(self.robot.footprint_radius, self._field_of_view(), self.params.explorer)
        self._planner = GridPlanner(self.params.planner)
        self._new_map: Future[None] = Future()
        self._turn = -2.0 * math.pi
        self._task: Task[None] = self.spawn(self._explore())

    def _field_of_view(self) -> float:
        sensors = self.robot.sensors
        if sensors.lidar is not None or sensors.depth_camera is None:
            return 2.0 * math.pi
        return sensors.depth_camera.field_of_view

    def on_map(self, _: OccupancyGrid) -> None:
        """Complete the future of the tasks that wait for a map."""
        pending, self._new_map = self._new_map, Future()
        pending.set_result(None)

    def on_cancel(self, _: Empty) -> None:
        """Cancel the exploration on request of the operator."""
        self._task.cancel()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Cancel the exploration; it does not resume by itself after the release."""
        if pressed.data:
            self._task.cancel()

    async def _explore(self) -> None:
        await self.sleep(0.0)  # restored messages are delivered first
        restored = self.restored_status.last
        if restored is not None and restored.done:
            self.exploration_status.publish(restored)
            return
        if restored is not None and pressed_since(self.restored_stop.last, restored.header.stamp.ns):
            self._publish_status(True, ExplorationDecision(None, ()), "Exploration ended: emergency stop.")
            return
        try:
            await self._look_around()
            empty_maps = 0
            while empty_maps < EMPTY_MAPS_TO_FINISH:
                await self._await_new_map()
                decision = self._decide()
                empty_maps = empty_maps + 1 if decision.goal is None else 0
                if decision.goal is not None:
                    self._publish_status(False, decision, "Exploring.")
                    await self._visit(decision.goal)
            if self.params.go_home:
                self._publish_status(False, decision, "Everything within reach is seen; going home.")
                await self._go(SE2(0.0, 0.0, 0.0))
            self._publish_status(True, decision, "Everything within reach is seen.")
        except Cancelled:
            self._publish_status(True, ExplorationDecision(None, ()), "Exploration was cancelled.")
            raise

    async def _look_around(self) -> None:
        """Turn once around, alternately left and right, so that the scale errors of the heading cancel."""
        self._turn = -self._turn
        await self.spin.call(Spin_Goal(self._turn, Duration.of(30.0)))

    async def _visit(self, goal: ExplorationGoal) -> None:
        """Drive to a goal, and stop early once its frontier has been mapped on the way."""
        driving = self._go(goal.pose)
        try:
            while not driving.done and self._frontier_remains(goal):
                await wait_any(driving, self.sleep(CHECK_PERIOD))
        finally:
            driving.discard()
        if driving.done and driving.result().error_code:
            self._explorer.mark_failed(goal)
        elif driving.done:
            if goal.look_around:
                await self._look_around()
            await self._await_new_map()
            if self._frontier_remains(goal):
                self._explorer.mark_failed(goal)

    async def _await_new_map(self) -> None:
        """Wait for the next map, with a timeout: a mapper without new data publishes none."""
        while self.map.last is None:
            await self._new_map
        await wait_any(self._new_map, self.sleep(MAP_TIMEOUT))

    def _go(self, pose: SE2) -> Future[NavigateToPose_Result]:
        stamped = PoseStamped(Header.of(self.now_ns, "map"), Pose.of(pose))
        return self.navigate_to_pose.call(NavigateToPose_Goal(stamped))

    def _frontier_remains(self, goal: ExplorationGoal) -> bool:
        """Return whether the goal's frontier is still there."""
        if self.map.last is None:
            return True
        return self._explorer.frontier_remains(self.map.last.grid, goal)

    def _decide(self) -> ExplorationDecision:
        """Select the next goal on the latest map."""
        assert self.map.last is not None
        grid = self.map.last.grid
        robot = self.tf.lookup("map", "base_link")
        return self._explorer.decide(grid, self._cost_to_come(grid, robot), robot)

    def _cost_to_come(self, grid: Grid, robot: SE2) -> NDArray[np.float32]:
        costs = LayeredCostmap(
            self.params.costmap,
            self.robot.footprint_radius,
            avoid_unknown=self.robot.sensors.forward_sensing_only,
        )
        costs.set_static(grid)
        try:
            return self._planner.potential(costs.update(), robot)
        except PlanningError:
            # the robot's cell is occupied: nothing is reachable
            return np.full(grid.cells.shape, np.inf, np.float32)

    def _publish_status(self, done: bool, decision: ExplorationDecision, sentence: str) -> None:
        remaining = tuple(
            f"({frontier.x:.1f}, {frontier.y:.1f}) {frontier.length:.1f} m: {frontier.reason}"
            for frontier in decision.skipped
        )
        header = Header.of(self.now_ns, "map")
        self.exploration_status.publish(ExplorationStatus(header, done, len(remaining), sentence, remaining))
