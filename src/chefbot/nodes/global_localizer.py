"""Active global localization: turns and moves carefully until localization has converged."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.behavior.relocalization import SPIN_STEP, SPIN_STEP_GOAL, LocalizationMonitor
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import DriveOnHeading, DriveOnHeading_Goal, Spin, Spin_Goal
from chefbot.msgs.std_msgs import Bool
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Task, wait_any
from chefbot.runtime.node import In, Node, Out, restored, topic

MOVE_DISTANCE = 0.6
"""Distance to move after a full turn without convergence, m; shorter if blocked."""


class GlobalLocalizerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the search for the pose."""

    rounds: Annotated[int, Meta(ge=1, le=100, description="maximum number of search rounds")] = 8


class GlobalLocalizerNode(Node):
    """Turns and moves carefully, by sensors only, until localization has converged for some updates.

    The result is published once on `localized`; navigation waits for it.
    """

    params: GlobalLocalizerParams
    localization_status: In[LocalizationStatus]
    restored_localized: In[Bool] = restored("localized")
    emergency_stop: In[Bool]
    spin = action_client(Spin)
    drive_on_heading = action_client(DriveOnHeading)
    localized: Out[Bool] = topic(latched=True)

    def start(self) -> None:
        """Start the search, unless the robot was localized before a restart."""
        self._localization = LocalizationMonitor()
        self._task: Task[None] = self.spawn(self._search())

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Cancel the search; it does not resume after the release: the operator may set the initial pose."""
        if pressed.data and not self._task.done:
            self._task.cancel()
            self.localized.publish(Bool(False))

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Count the consecutive updates with converged localization."""
        self._localization.process(status)

    async def _search(self) -> None:
        await self.sleep(0.0)  # restored messages are delivered first
        if self.restored_localized.last is not None and self.restored_localized.last.data:
            self.localized.publish(Bool(True))
            return
        for _ in range(self.params.rounds):
            turned = 0.0
            while turned < 2.0 * math.pi:
                # ends also when another motion preempts it
                await wait_any(self.spin.call(SPIN_STEP_GOAL))
                turned += SPIN_STEP
                if self._localization.has_settled:
                    self.localized.publish(Bool(True))
                    return
            await self._move_on()
        self.localized.publish(Bool(False))

    async def _move_on(self) -> None:
        """Drive forward; if that fails turn by 120 degrees and try again in the next round."""
        result = await self.drive_on_heading.call(
            DriveOnHeading_Goal(Point(MOVE_DISTANCE), 0.15, Duration.of(15.0))
        )
        if result.error_code:
            await self.spin.call(Spin_Goal(2.0 * math.pi / 3.0, Duration.of(15.0)))
