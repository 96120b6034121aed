"""The gain that a goal of exploration must promise: it rises while goals show little of what they promised."""

from __future__ import annotations

GOOD_SHARE = 0.25
"""Share of the promised gain from which a goal was worth its drive."""
RISE, FALL = 2.0 ** (1.0 / 3.0), 0.5
"""Factors after a goal that was not, and after one that was: three poor ones are made up for by a good one."""


class RequiredGain:
    """The minimum gain of a goal, m^2, never below `minimum`.

    A gap in a wall promises all the unknown space behind it and shows none. Without this the exploration of a
    building that is mapped already continues from gap to gap.
    """

    def __init__(self, minimum: float) -> None:
        self.minimum = self.value = minimum

    def update(self, promised: float, shown: float) -> None:
        """Take the gain of a goal that was tried, as it was promised and as the map has grown, m^2."""
        factor = FALL if shown >= GOOD_SHARE * promised else RISE
        self.value = max(self.minimum, factor * self.value)
