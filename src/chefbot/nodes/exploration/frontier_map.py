"""The growing map of an exploration, and the goals at its frontiers."""

from __future__ import annotations

import contextlib

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.exploration.blockages import Blockages, without_room
from chefbot.exploration.dead_ends import DeadEnds
from chefbot.exploration.explorer import LEARNED_WEIGHT, ExplorationDecision, ExplorationGoal, Explorer
from chefbot.exploration.session import field_of_view
from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.nodes.navigation.narrow_passages import fits_narrow_passages
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.planner import PlanningError
from chefbot.runtime.coroutines import Future, wait_any
from chefbot.runtime.node import In, Node, topic

MAP_TIMEOUT = 2.5
"""Maximum time that the mapper takes to publish a new map, s."""


class FrontierMapNode(Node):
    """Base class of a node that selects goals at the frontiers of the latest map.

    Its parameters have the fields `explorer`, `costmap` and `planner`.
    """

    map: In[OccupancyGrid]
    planner_costmap: In[OccupancyGrid] = topic("global_costmap/costmap")

    def start(self) -> None:
        """Create the explorer and the planner; the first map is still to come."""
        self._explorer = Explorer(
            self.robot.inscribed_radius, field_of_view(self.robot), self.params.explorer
        )
        self._planner = GridPlanner(self.params.planner)
        self._blockages = Blockages(self.robot.inscribed_radius)
        self._dead_ends = DeadEnds()
        self._new_map: Future[None] = Future()

    def on_map(self, _: OccupancyGrid) -> None:
        """Complete the future of the tasks that wait for a map."""
        pending, self._new_map = self._new_map, Future()
        pending.set_result(None)

    async def _await_new_map(self) -> None:
        """Wait for the next map, with a timeout: a mapper without new data publishes none."""
        while self.map.last is None:
            await self._new_map
        await wait_any(self._new_map, self.sleep(MAP_TIMEOUT))

    def _frontier_remains(self, goal: ExplorationGoal) -> bool:
        """Return whether the goal's frontier is still there."""
        if self.map.last is None:
            return True
        return self._explorer.frontier_remains(self.map.last.grid, goal)

    @property
    def _known_area(self) -> float:
        """Area of the latest map that is known, m^2."""
        if self.map.last is None:
            return 0.0
        grid = self.map.last.grid
        return float(np.count_nonzero(grid.cells >= 0)) * grid.resolution**2

    def _decide(self) -> ExplorationDecision:
        """Select the next goal on the latest map, but none behind a place at which drives have ended."""
        assert self.map.last is not None
        grid, robot = self.map.last.grid, self.tf.lookup("map", "base_link")
        if self.planner_costmap.last is not None:
            self._blockages.forget_gone(robot, self.planner_costmap.last.grid, grid)
        decision = self._select(grid, robot)
        while decision.goal and self._is_behind_dead_end(decision.goal, robot, grid):
            self._explorer.give_up(decision.goal)
            decision = self._select(grid, robot)
        return decision

    def _is_behind_dead_end(self, goal: ExplorationGoal, robot: SE2, grid: Grid) -> bool:
        return self._dead_ends.exist and self._dead_ends.is_on(self._path_to(goal, robot, grid))

    def _select(self, grid: Grid, robot: SE2) -> ExplorationDecision:
        """Select a goal; those beyond narrow passages come after all others."""
        costs = self._costs_of(self._blockages.on(grid))
        open_costs = costs.update()
        closed = open_costs.cells >= INSCRIBED
        if self.planner_costmap.last is not None:  # the planner has no goals where an obstacle is off the map
            closed |= without_room(self.planner_costmap.last.grid, grid)
        cost = self._cost_to_come(open_costs, robot)
        cost[closed] = np.inf
        decision = self._explorer.decide(grid, cost, robot)
        if (decision.goal and not decision.goal.blocked) or not fits_narrow_passages(self.robot):
            return decision
        narrow = self._cost_to_come(self._narrow_costs(costs, grid), robot)
        narrow[closed] = np.inf  # a way through, but no place to stop at
        beyond = self._explorer.decide(grid, narrow, robot)
        return beyond if beyond.goal and not beyond.goal.blocked else decision

    def _note_failed(self, goal: ExplorationGoal) -> None:
        """Record that a goal was not reached, and what blocks the robot here although it is not on the map."""
        learned = False
        if self.map.last is not None and self.planner_costmap.last is not None:
            robot, grid = self.tf.lookup("map", "base_link"), self.map.last.grid
            path = self._path_to(goal, robot, grid)
            learned = self._blockages.add(robot, path, self.planner_costmap.last.grid, grid)
            self._dead_ends.add(robot, path)
        self._explorer.mark_failed(goal, LEARNED_WEIGHT if learned else 1.0)

    def _path_to(self, goal: ExplorationGoal, robot: SE2, grid: Grid) -> NDArray[np.float64]:
        """Return the path (n, 3) to a goal on the map with the known blockages; empty if there is none."""
        costs = self._costs_of(self._blockages.on(grid))
        with contextlib.suppress(PlanningError):
            return self._planner.plan(costs.update(), robot, goal.pose)
        if fits_narrow_passages(self.robot):
            with contextlib.suppress(PlanningError):
                return self._planner.plan(self._narrow_costs(costs, grid), robot, goal.pose)
        return np.zeros((0, 3))

    def _narrow_costs(self, costs: LayeredCostmap, grid: Grid) -> Costmap:
        """Return costs in which passages are open where the robot just fits, for one that may creep through them."""
        return costs.narrow_costs(-0.5 * grid.resolution, np.zeros((0, 2)), 0.0)

    def _costs_of(self, grid: Grid) -> LayeredCostmap:
        costs = LayeredCostmap(
            self.params.costmap,
            self.robot.footprint,
            avoid_unknown=self.robot.sensors.forward_sensing_only,
        )
        costs.set_static(grid)
        return costs

    def _cost_to_come(self, costs: Costmap, robot: SE2) -> NDArray[np.float32]:
        try:
            return self._planner.potential(costs, robot)
        except PlanningError:
            # the robot's cell is occupied: nothing is reachable
            return np.full(costs.cells.shape, np.inf, np.float32)
