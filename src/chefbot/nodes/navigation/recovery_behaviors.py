"""Client of the behavior server: recovery behaviors of a robot that is blocked, and relocalization of a lost one."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from chefbot.behavior.motion_errors import BACK_UP, SPIN, BehaviorErrorCodes
from chefbot.behavior.relocalization import (
    LOST,
    YIELD_TIME,
    LocalizationMonitor,
    Relocalization,
    RelocalizationStep,
)
from chefbot.control.waiting_state import WAIT_TIMEOUT
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.nav2_msgs import BackUp, BackUp_Goal, BackUp_Result, Spin, Spin_Goal, Spin_Result
from chefbot.msgs.std_msgs import Float64, String
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Future, wait_any
from chefbot.runtime.node import In, Node, Out, topic

COSTMAP_REFRESH_TIME = 1.0
"""Time that the sensors need to mark the present obstacles again, s."""
SILENT, PREEMPTED = "The behavior server does not answer.", "Another motion has preempted this one."
R = TypeVar("R")


class RecoveryBehaviorsNode(Node):
    """Base class of a node that runs recovery behaviors and knows whether localization has converged."""

    localization_status: In[LocalizationStatus]
    wait_reason: In[String] = topic("controller/wait_reason")
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

    def on_wait_reason(self, _: String) -> None:
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
        return relocalization.failure_reason

    async def _motion_result(
        self, motion: Future[R], allowance: float, result: Callable[[int, str], R], codes: BehaviorErrorCodes
    ) -> R:
        """Return the result of a motion; one with an error if it is preempted, or if the server does not answer.

        allowance: time that the motion may take, s; the server may wait for a sensor as well. result: makes a result.
        """
        await wait_any(motion, self.sleep(allowance + WAIT_TIMEOUT))
        if not motion.done:
            motion.discard()
            return result(codes.timeout, SILENT)
        try:
            return motion.result()
        except Cancelled:
            return result(codes.unknown, PREEMPTED)

    async def _spin_by(self, angle: float, allowance: float) -> Spin_Result:
        """Rotate in place by an angle (rad) within an allowance (s)."""
        spinning = self.spin.call(Spin_Goal(angle, Duration.of(allowance)))
        return await self._motion_result(
            spinning, allowance, lambda code, text: Spin_Result(Duration(), code, text), SPIN
        )

    async def _spin(self, goal: Spin_Goal) -> Spin_Result | None:
        """Rotate by one step; return None if another motion preempted this one."""
        spinning = self.spin.call(goal)
        await wait_any(spinning)
        try:
            return spinning.result()
        except Cancelled:
            return None

    async def _back_up(self, goal: BackUp_Goal) -> BackUp_Result:
        """Back up, but not while localization is lost: relocalization comes first."""
        if self._localization.is_lost:
            return BackUp_Result(error_code=BACK_UP.unknown, error_msg=LOST)
        backing = self.backup.call(goal)
        self._localization_lost = Future()
        await wait_any(backing, self._localization_lost)
        if backing.done:
            return backing.result()
        backing.discard()
        return BackUp_Result(error_code=BACK_UP.unknown, error_msg=LOST)

    async def _clear_costmaps(self, radius: float) -> None:
        """Clear obstacles within a radius (m), and wait until the sensors have marked what is there."""
        self.clear_costmaps.publish(Float64(radius))
        await self.sleep(COSTMAP_REFRESH_TIME)

    def _pending(self, work: Coroutine[Any, Any, object]) -> Future[object]:
        """Run a coroutine as a task that is cancelled when its future is discarded."""
        task = self.spawn(work)
        future: Future[object] = Future(on_cancel=task.cancel)

        def settle() -> None:
            try:
                future.set_result(task.result())
            except Exception as error:
                future.set_exception(error)

        task.add_done_callback(settle)
        return future
