"""Client of the behavior server: recovery behaviors of a robot that is blocked, and relocalization of a lost one."""

from __future__ import annotations

from chefbot.behavior.recovery import RecoveryBehavior, RecoveryParams
from chefbot.behavior.relocalization import (
    YIELD_TIME,
    LocalizationMonitor,
    Relocalization,
    RelocalizationStep,
)
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.nav2_msgs import BackUp, Spin, Spin_Goal, Spin_Result
from chefbot.msgs.std_msgs import Float64, String
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Future, wait_any
from chefbot.runtime.node import In, Node, Out, topic

COSTMAP_REFRESH_TIME = 1.0
"""Time that the sensors need to mark the present obstacles again, s."""


class RecoveryBehaviorsNode(Node):
    """Base class of a node that runs recovery behaviors and knows whether localization has converged."""

    localization_status: In[LocalizationStatus]
    standing: In[String] = topic("controller/standing")
    monitor_reason: In[String] = topic("collision_monitor/reason")
    spin = action_client(Spin)
    backup = action_client(BackUp)
    clear_costmaps: Out[Float64]

    def start(self) -> None:
        """Start as localized, until the first status."""
        self._localization = LocalizationMonitor()
        self._localization_lost: Future[None] = Future()

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Count consecutive localized updates, and interrupt what waits for the loss of localization."""
        self._localization.process(status)
        if self._localization.is_lost:
            self._localization_lost.set_result(None)

    def on_standing(self, _: String) -> None:
        """Publish the status again when the controller starts or stops waiting."""
        self._repeat_status()

    def on_monitor_reason(self, _: String) -> None:
        """Publish the status again when the collision monitor begins or ceases to limit the motion."""
        self._repeat_status()

    def _repeat_status(self) -> None:
        """Publish the status of an active goal again; a node without one has nothing to publish."""

    @property
    def _limit(self) -> str:
        """Why the collision monitor limits the motion; empty if it does not."""
        return self.monitor_reason.last.data if self.monitor_reason.last else ""

    async def _relocalize(self) -> str:
        """Rotate in place until localization has converged; return an error message, empty on success."""
        relocalization, step = Relocalization(self._localization), RelocalizationStep.SPIN
        while step is RelocalizationStep.SPIN:
            step = relocalization.after_spin(await self._spin(relocalization.goal))
            if step is RelocalizationStep.YIELD:
                await self.sleep(YIELD_TIME)
                step = relocalization.after_yield()
        return relocalization.fault

    async def _spin(self, goal: Spin_Goal) -> Spin_Result | None:
        """Rotate by one step; return None if another motion preempted this one."""
        spinning = self.spin.call(goal)
        await wait_any(spinning)
        try:
            return spinning.result()
        except Cancelled:
            return None

    async def _back_up(self, params: RecoveryParams) -> None:
        """Back up, but not while localization is lost: relocalization comes first."""
        if self._localization.is_lost:
            return
        backing = self.backup.call(params.back_up_goal(self.robot))
        self._localization_lost = Future()
        await wait_any(backing, self._localization_lost)
        if backing.done:
            backing.result()
        else:
            backing.discard()

    async def _recover(self, behavior: RecoveryBehavior, params: RecoveryParams) -> None:
        if behavior is RecoveryBehavior.CLEAR:
            self.clear_costmaps.publish(Float64(params.clear_radius))
            await self.sleep(COSTMAP_REFRESH_TIME)
        elif behavior is RecoveryBehavior.SPIN:
            await self.spin.call(params.spin_goal)
        elif behavior is RecoveryBehavior.BACK_UP:
            await self._back_up(params)
        else:
            await self.sleep(params.wait)
