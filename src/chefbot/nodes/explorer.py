"""Autonomous exploration: drives to frontiers until no reachable one is left."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.costmap.params import CostmapParams
from chefbot.exploration.explorer import ExplorationGoal
from chefbot.exploration.params import ExplorerParams
from chefbot.exploration.session import ExplorationSession
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, ExplorationStatus
from chefbot.msgs.nav2_msgs import Spin
from chefbot.msgs.std_msgs import Bool, Empty
from chefbot.nodes.exploration.drives import ExplorationDrivesNode
from chefbot.nodes.exploration.reports import RobotFaultError
from chefbot.planning.params import PlannerParams
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Task
from chefbot.runtime.node import In, restored
from chefbot.safety.emergency_stop import is_pressed, pressed_since

READY = "Ready to explore."

STOPPED = "The emergency stop is active. Release STOP, then explore again."


class ExplorerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of reachability and goal selection."""

    explorer: ExplorerParams = ExplorerParams()
    costmap: CostmapParams = CostmapParams()
    planner: PlannerParams = PlannerParams()
    go_home: Annotated[bool, Meta(description="whether to return to the start")] = True
    autostart: Annotated[bool, Meta(description="whether to explore from the start, else on request")] = True


class ExplorerNode(ExplorationDrivesNode):
    """Sends the navigator from frontier to frontier; `exploration_status` reports progress and skipped frontiers.

    true on `explore` begins an exploration, or continues one that was ended, on the map as it is; false ends it.
    """

    live_params = ("go_home",)
    params: ExplorerNodeParams
    cancel: In[Empty]
    explore: In[Bool]
    emergency_stop: In[Bool]
    restored_status: In[ExplorationStatus] = restored("exploration_status")
    restored_stop: In[EmergencyStopStatus] = restored("stop_status")
    spin = action_client(Spin)

    def start(self) -> None:
        """Start exploring with a full turn, also after a restart, with the map as it is."""
        import scipy.ndimage
        import scipy.spatial  # noqa: F401 (the imports take 0.1 s and more: now, not at the first decision)

        super().start()
        self._refused = False
        self._task: Task[None] = self.spawn(self._explore())

    def on_explore(self, wanted: Bool) -> None:
        """Begin or end an exploration on request of the operator."""
        if not wanted.data:
            self._task.cancel()
        elif is_pressed(self.emergency_stop.last):
            self._refused = True
            self._publish_idle(STOPPED)
        elif self._task.done:
            self._session = ExplorationSession()
            self._task = self.spawn(self._explore_once())

    def on_cancel(self, _: Empty) -> None:
        """Cancel the exploration on request of the operator."""
        self._task.cancel()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Cancel the exploration; it does not resume by itself after the release."""
        if pressed.data:
            self._task.cancel()
        elif self._refused:
            self._refused = False
            self._publish_idle(READY)

    async def _explore(self) -> None:
        await self.sleep(0.0)  # restored messages are delivered first
        restored = self.restored_status.last
        if restored is not None and restored.done:
            self.exploration_status.publish(restored)
            return
        if restored is not None and pressed_since(self.restored_stop.last, restored.header.stamp.ns):
            self._publish_idle("Exploration ended: emergency stop.")
            return
        if restored is None and not self.params.autostart:
            self._publish_idle(READY)
            return
        await self._explore_once()

    async def _explore_once(self) -> None:
        try:
            await self._explore_all()
        except Cancelled:
            self._publish_idle("Exploration was cancelled.")
            raise
        except RobotFaultError as fault:
            self._publish_end(f"Exploration ended: {fault}")

    async def _explore_all(self) -> None:
        """Visit one goal after the other until none is left, then return to the start."""
        session = self._session
        await self.spin.call(session.next_turn())
        await self._await_new_map()
        while (goal := session.process(self._decide())) or not session.is_complete:
            self._publish_progress(session.progress)
            if goal is None or not await self._visit(goal, self._known_area):
                await self._await_new_map()
        if self.params.go_home:
            self._publish_progress(f"{session.result} Going home.")
            await self._go(SE2(0.0, 0.0, 0.0))
        self._publish_end(session.result)

    async def _visit(self, goal: ExplorationGoal, known: float) -> bool:
        """Drive to a goal, at most until its frontier is mapped; return whether the latest map shows the result.

        known: area known before, m^2.
        """
        reached = await self._reach(goal)
        if reached:
            if goal.look_around:
                await self.spin.call(self._session.next_turn())
            await self._await_new_map()
            if self._frontier_remains(goal):
                self._explorer.mark_failed(goal)
        if not self._held_up:
            self._explorer.note_gain(goal, self._known_area - known)
        return reached or not self._frontier_remains(goal)
