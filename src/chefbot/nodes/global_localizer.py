"""Finds out where the robot is: looks around, and moves on a little while it is not sure."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import DriveOnHeading, DriveOnHeading_Goal, Spin, Spin_Goal
from chefbot.msgs.std_msgs import Bool
from chefbot.runtime.actions import calls
from chefbot.runtime.coroutines import Task, first_of
from chefbot.runtime.node import In, Node, Out, last_words, topic

SURE_FOR = 3
"""So many updates in a row must be sure: two rooms can look alike for a moment."""
PIECE = math.pi / 4
"""Radians of a turn between two looks at how sure it is."""
STEP = 0.6
"""Metres that it goes on when a whole turn did not tell; shorter if something is in the way."""


class FinderParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How long it tries."""

    rounds: Annotated[int, Meta(ge=1, le=100, description="turns and steps before it gives up")] = 8


class FinderNode(Node):
    """Turns and moves carefully, by what its sensors see alone, until localization has been sure for a while.

    `localized` says so, once for all; navigation waits for it.
    """

    params: FinderParams
    localization_status: In[LocalizationStatus]
    found_before: In[Bool] = last_words("localized")
    emergency_stop: In[Bool]
    spin = calls(Spin)
    drive_on_heading = calls(DriveOnHeading)
    localized: Out[Bool] = topic(latched=True)

    def start(self) -> None:
        """Begin at once, unless it was found in a life before."""
        self._sure = 0
        self._task: Task[None] = self.spawn(self._search())

    def on_emergency_stop(self, pressed: Bool) -> None:
        """It does not go on by itself when the button is released: a person may say where the robot is."""
        if pressed.data and not self._task.done:
            self._task.cancel()
            self.localized.publish(Bool(False))

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Count how long it has been sure."""
        self._sure = self._sure + 1 if status.localized else 0

    async def _search(self) -> None:
        await self.sleep(0.0)  # last words come before
        if self.found_before.last is not None and self.found_before.last.data:
            self.localized.publish(Bool(True))
            return
        for _ in range(self.params.rounds):
            turned = 0.0
            while turned < 2.0 * math.pi:
                await first_of(self.spin.call(Spin_Goal(PIECE, Duration.of(15.0))))  # or what took its place
                turned += PIECE
                if self._sure >= SURE_FOR:
                    self.localized.publish(Bool(True))
                    return
            await self._step()
        self.localized.publish(Bool(False))

    async def _step(self) -> None:
        """Forward if it can, else turn a third and try again next round."""
        result = await self.drive_on_heading.call(DriveOnHeading_Goal(Point(STEP), 0.15, Duration.of(15.0)))
        if result.error_code:
            await self.spin.call(Spin_Goal(2.0 * math.pi / 3.0, Duration.of(15.0)))
