"""Shapes of the plates, seen from above in base_link: origin below the middle of the axle, x forward."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.maths.outline import Loop, circle, rectangle


class RoundPlate(NamedTuple):
    """A round plate about the middle of the axle, m."""

    radius: float

    @property
    def front(self) -> float:
        """Distance from the axle to the front edge, m."""
        return self.radius

    @property
    def back(self) -> float:
        """Distance from the axle to the back edge, m."""
        return self.radius

    @property
    def half_width(self) -> float:
        """Distance from the middle to the edge at the axle, m."""
        return self.radius

    def half_width_at(self, x: float) -> float:
        """Return the distance from the middle to the edge at `x`, m; 0 beyond the plate."""
        return math.sqrt(max(self.radius**2 - x**2, 0.0))

    def room(self, x: float, y: float) -> float:
        """Return the distance from the point (|x|, |y|) to the edge, m; negative outside."""
        return self.radius - math.hypot(x, y)

    def loop(self) -> Loop:
        """Return the edge of the plate as a closed curve in base_link, m."""
        return circle(self.radius)

    def __str__(self) -> str:
        return f"plate of {1000 * self.radius:.4g} mm radius"


class RectangularPlate(NamedTuple):
    """A rectangular plate: distances of its front, back and sides from the middle of the axle, m."""

    front: float
    back: float
    half_width: float

    def half_width_at(self, x: float) -> float:
        """Return the distance from the middle to the edge at `x`, m; 0 beyond the plate."""
        return self.half_width if -self.back <= x <= self.front else 0.0

    def room(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest edge, m; negative outside."""
        return min(self.front - x, self.back + x, self.half_width - abs(y))

    def loop(self) -> Loop:
        """Return the edge of the plate as a closed curve in base_link, m."""
        length = self.front + self.back
        return rectangle(length, 2.0 * self.half_width, (self.front - self.back) / 2.0)

    def __str__(self) -> str:
        return f"plate of {1000 * (self.front + self.back):.4g} x {2000 * self.half_width:.4g} mm"
