"""The outline of a robot on the floor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Footprint(NamedTuple):
    """The footprint in base_link, m: the largest circle about the origin inside of it, and the smallest around it.

    corners: (x, y) counter-clockwise of a convex polygon; empty for a disc, whose two radii are equal.
    """

    inscribed_radius: float
    circumscribed_radius: float
    corners: tuple[tuple[float, float], ...] = ()

    @property
    def front(self) -> float:
        """Distance from the origin to the foremost point, m."""
        return max((x for x, _ in self.corners), default=self.circumscribed_radius)

    def polygon(self, padding: float = 0.0) -> NDArray[np.float64]:
        """Return the corners (n, 2), each moved outwards by `padding` along x and y; (0, 2) for a disc."""
        corners = np.array(self.corners, np.float64).reshape(-1, 2)
        return corners + padding * np.sign(corners)


def disc(radius: float) -> Footprint:
    """Return the footprint of a round robot."""
    return Footprint(radius, radius)
