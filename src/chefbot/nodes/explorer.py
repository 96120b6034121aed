"""Maps a building by itself: goes where it has not looked yet, until nothing that can be reached is left."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.exploration.explorer import Decision, Explorer, Goal
from chefbot.exploration.params import ExplorerParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import ExplorationStatus, StopStatus
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
from chefbot.runtime.actions import calls
from chefbot.runtime.coroutines import Cancelled, Future, Task, first_of
from chefbot.runtime.node import In, Node, Out, last_words, topic
from chefbot.safety.emergency_stop import pressed_since

LOOK_PERIOD = 2.0
"""Seconds between two looks at the growing map while driving."""
MAP_PATIENCE = 2.5
"""Seconds that a mapper takes to publish what it has seen."""
DONE_LOOKS = 2
"""So many maps in a row must show nothing to explore: the last scans may not be drawn yet."""


class ExplorerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What counts as reachable, and how goals are chosen."""

    explorer: ExplorerParams = ExplorerParams()
    costmap: CostmapParams = CostmapParams()
    planner: PlannerParams = PlannerParams()
    go_home: Annotated[bool, Meta(description="whether it comes back to where it began")] = True


class ExplorerNode(Node):
    """Sends the navigator from frontier to frontier; `exploration_status` says how far it is, what is left."""

    live_params = ("go_home",)
    params: ExplorerNodeParams
    map: In[OccupancyGrid]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    told_before: In[ExplorationStatus] = last_words("exploration_status")
    stop_before: In[StopStatus] = last_words("stop_status")
    navigate_to_pose = calls(NavigateToPose)
    spin = calls(Spin)
    exploration_status: Out[ExplorationStatus] = topic(latched=True)

    def start(self) -> None:
        """Begin with a look around; in another life go on, from the map as it is."""
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
        """Wake who waits for it."""
        waiting, self._new_map = self._new_map, Future()
        waiting.set(None)

    def on_cancel(self, _: Empty) -> None:
        """The operator has had enough."""
        self._task.cancel()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """It does not go on by itself when the button is released."""
        if pressed.data:
            self._task.cancel()

    async def _explore(self) -> None:
        await self.sleep(0.0)  # last words come before
        told = self.told_before.last
        if told is not None and told.done:
            self.exploration_status.publish(told)
            return
        if told is not None and pressed_since(self.stop_before.last, told.header.stamp.ns):
            self._tell(True, Decision(None, ()), "Exploration ended when STOP was pressed.")
            return
        try:
            await self._look_around()
            empty = 0
            while empty < DONE_LOOKS:
                await self._fresh_map()
                decision = self._decide()
                empty = empty + 1 if decision.goal is None else 0
                if decision.goal is not None:
                    self._tell(False, decision, "Exploring.")
                    await self._visit(decision.goal)
            if self.params.go_home:
                self._tell(False, decision, "Everything within reach is seen; going home.")
                await self._go(SE2(0.0, 0.0, 0.0))
            self._tell(True, decision, "Everything within reach is seen.")
        except Cancelled:
            self._tell(True, Decision(None, ()), "Exploration was cancelled.")
            raise

    async def _look_around(self) -> None:
        """Once left, once right about, so that a turn's error of scale is taken back by the next."""
        self._turn = -self._turn
        await self.spin.call(Spin_Goal(self._turn, Duration.of(30.0)))

    async def _visit(self, goal: Goal) -> None:
        """Go and look; turn to a better goal as soon as this one has shown itself on the way."""
        going = self._go(goal.pose)
        try:
            while not going.done and self._worth(goal):
                await first_of(going, self.sleep(LOOK_PERIOD))
        finally:
            going.abandon()
        if going.done and going.result().error_code:
            self._explorer.fruitless(goal)
        elif going.done:
            if goal.look_around:
                await self._look_around()
            await self._fresh_map()
            if self._worth(goal):
                self._explorer.fruitless(goal)

    async def _fresh_map(self) -> None:
        """The next map; a mapper that has nothing to add publishes none."""
        while self.map.last is None:
            await self._new_map
        await first_of(self._new_map, self.sleep(MAP_PATIENCE))

    def _go(self, pose: SE2) -> Future[NavigateToPose_Result]:
        stamped = PoseStamped(Header.of(self.now_ns, "map"), Pose.of(pose))
        return self.navigate_to_pose.call(NavigateToPose_Goal(stamped))

    def _worth(self, goal: Goal) -> bool:
        """Whether the goal's frontier is still there."""
        if self.map.last is None:
            return True
        return self._explorer.still_there(self.map.last.grid, goal)

    def _decide(self) -> Decision:
        """The next goal on the map as it is now."""
        assert self.map.last is not None
        grid = self.map.last.grid
        here = self.tf.lookup("map", "base_link")
        return self._explorer.decide(grid, self._cost_to_come(grid, here), here)

    def _cost_to_come(self, grid: Grid, here: SE2) -> NDArray[np.float32]:
        costs = LayeredCostmap(
            self.params.costmap, self.robot.footprint_radius, wary=self.robot.sensors.look_ahead_only
        )
        costs.set_static(grid)
        try:
            return self._planner.potential(costs.update(), here)
        except PlanningError:
            return np.full(grid.cells.shape, np.inf, np.float32)  # inside something: nothing is reachable

    def _tell(self, done: bool, decision: Decision, sentence: str) -> None:
        left = tuple(f"({one.x:.1f}, {one.y:.1f}) {one.length:.1f} m: {one.reason}" for one in decision.left)
        header = Header.of(self.now_ns, "map")
        self.exploration_status.publish(ExplorationStatus(header, done, len(left), sentence, left))
