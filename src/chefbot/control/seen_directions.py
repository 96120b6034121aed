"""When a sensor last had data in each direction around the robot."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2

SECTORS = 72
"""Number of directions that are distinguished, of a whole turn."""
SECTOR = math.tau / SECTORS
SEEN_FRACTION = 0.5
"""Fraction of a sector's beams that must have data for it to be seen."""
SAME_PLACE_DISTANCE = 0.15
"""Distance up to which the robot is in the same place, and sees the same ground in a direction, m."""
NEVER_NS = np.iinfo(np.int64).min


class SeenDirections:
    """The time at which each direction was last seen from where the robot is, without anything hidden there since.

    What it saw from elsewhere is forgotten. Poses are in a frame that does not jump (odom), directions are angles in
    that frame, rad.
    """

    def __init__(self) -> None:
        self._seen_ns = np.full(SECTORS, NEVER_NS)
        self._place: SE2 | None = None

    def process(
        self, robot: SE2, directions: NDArray[np.float64], has_data: NDArray[np.bool_], stamp_ns: int
    ) -> None:
        """Process the beams (n,) of one message; has_data: whether each measured anything, or need not to."""
        if self._place is None or robot.distance(self._place) > SAME_PLACE_DISTANCE:
            self._place = robot
            self._seen_ns[:] = NEVER_NS
        sectors = np.floor(directions / SECTOR).astype(np.int64) % SECTORS
        beams = np.bincount(sectors, minlength=SECTORS)
        with_data = np.bincount(sectors[has_data], minlength=SECTORS)
        # where there is no data now, somebody may have come who is too near to be seen
        seen = with_data >= SEEN_FRACTION * beams
        self._seen_ns[beams > 0] = np.where(seen, stamp_ns, NEVER_NS)[beams > 0]

    def not_seen_since(self, since_ns: int, low: float, high: float) -> NDArray[np.float64]:
        """Return the middles (n,) of the sectors from `low` to `high`, rad, that were not seen since then."""
        numbers = np.arange(math.floor(low / SECTOR), math.floor(high / SECTOR) + 1)
        unseen = self._seen_ns[numbers % SECTORS] < since_ns
        return np.asarray((numbers[unseen] + 0.5) * SECTOR)
