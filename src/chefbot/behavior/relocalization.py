"""Relocalization of a lost robot: it rotates in place, where that is free, until localization has converged."""

from __future__ import annotations

import math
from enum import Enum

from chefbot.behavior.motion_errors import SPIN
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.nav2_msgs import Spin_Goal, Spin_Result

SPIN_STEP = math.pi / 4
"""Angle that a lost robot rotates between two checks of the localization, rad."""
SPIN_STEP_GOAL = Spin_Goal(SPIN_STEP, Duration.of(15.0))
"""Goal of one rotation step."""
MAX_SPIN_STEPS = 24
"""Number of rotation steps (three turns) after which a lost robot aborts the goal."""
LOCALIZED_UPDATES_REQUIRED = 3
"""Consecutive localized updates required, because two places can look alike for a moment."""
YIELD_TIME = 2.0
"""Time that a lost robot yields to another motion, as of the global localizer, before it rotates on, s."""
LOST = "Localization lost; rotating in place to relocalize."
NOT_FOUND = (
    "Not localized after {} turns in place; set the initial pose in the web UI, "
    "or move the robot by teleoperation."
)


class LocalizationMonitor:
    """Counts the consecutive localized updates of a localization."""

    def __init__(self) -> None:
        self.is_lost = False
        """Whether localization reports that it is lost; False without localization, as while mapping."""
        self._localized_updates = 0

    def process(self, status: LocalizationStatus) -> None:
        """Process the status of an update."""
        self.is_lost = not status.localized
        self._localized_updates = self._localized_updates + 1 if status.localized else 0

    @property
    def has_settled(self) -> bool:
        """Whether enough consecutive updates were localized."""
        return self._localized_updates >= LOCALIZED_UPDATES_REQUIRED


class RelocalizationStep(Enum):
    """What a lost robot does next."""

    SPIN = "rotate by one step"
    YIELD = "wait while another motion is active"
    LOCALIZED = "continue to the goal"
    FAILED = "abort the goal"


class Relocalization:
    """Judges one rotation step after the other; `failure_reason` is a sentence once it has failed, else empty."""

    def __init__(self, localization: LocalizationMonitor) -> None:
        self._localization = localization
        self._steps = self._blocked = 0
        self._direction = 1.0
        self.failure_reason = ""

    @property
    def goal(self) -> Spin_Goal:
        """Goal of the next rotation step; the other way round after a step that something blocked."""
        return Spin_Goal(self._direction * SPIN_STEP, SPIN_STEP_GOAL.time_allowance)

    def after_spin(self, result: Spin_Result | None) -> RelocalizationStep:
        """Return the next step after a rotation; `result` is None if another motion preempted it."""
        self._steps += 1
        if self._localization.has_settled:
            return RelocalizationStep.LOCALIZED
        if result is None:
            return RelocalizationStep.YIELD
        if result.error_code == SPIN.collision:
            return self._turn_back()
        self._blocked = 0
        return self._fail(result.error_msg) if result.error_code else self.after_yield()

    def _turn_back(self) -> RelocalizationStep:
        """Turn the other way round; stand for a while if that was blocked as well."""
        self._direction, self._blocked = -self._direction, self._blocked + 1
        return RelocalizationStep.YIELD if self._blocked % 2 == 0 else self.after_yield()

    def after_yield(self) -> RelocalizationStep:
        """Return the next step after another motion has had its time."""
        if self._steps < MAX_SPIN_STEPS:
            return RelocalizationStep.SPIN
        return self._fail(NOT_FOUND.format(round(MAX_SPIN_STEPS * SPIN_STEP / (2.0 * math.pi))))

    def _fail(self, failure_reason: str) -> RelocalizationStep:
        self.failure_reason = failure_reason
        return RelocalizationStep.FAILED
