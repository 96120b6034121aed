"""Axis-aligned rectangles, of which floor plans are made."""

from __future__ import annotations

from typing import NamedTuple

from numpy.random import Generator


class Rectangle(NamedTuple):
    """An axis-aligned rectangle from (x0, y0) to (x1, y1), m."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def width(self) -> float:
        """The extent along the x axis, m."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """The extent along the y axis, m."""
        return self.y1 - self.y0

    @property
    def area(self) -> float:
        """The area of the floor, m^2."""
        return self.width * self.depth

    @property
    def centre(self) -> tuple[float, float]:
        """The centre as (x, y), m."""
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2

    def expanded(self, margin: float) -> Rectangle:
        """Return the rectangle with `margin` metres more on every side; a negative margin shrinks it."""
        return Rectangle(self.x0 - margin, self.y0 - margin, self.x1 + margin, self.y1 + margin)

    def overlaps(self, other: Rectangle) -> bool:
        """Return whether the two share an area."""
        return self.x0 < other.x1 and other.x0 < self.x1 and self.y0 < other.y1 and other.y0 < self.y1

    def contains(self, other: Rectangle) -> bool:
        """Return whether the other one lies inside."""
        return self.x0 <= other.x0 and self.y0 <= other.y0 and other.x1 <= self.x1 and other.y1 <= self.y1


def around(x: float, y: float, width: float, depth: float) -> Rectangle:
    """Return the rectangle of these sides (m) with its centre at (x, y)."""
    return Rectangle(x - width / 2, y - depth / 2, x + width / 2, y + depth / 2)


def cuts(low: float, high: float, parts: list[float]) -> list[tuple[float, float]]:
    """Divide the interval (m) in proportion to `parts`, at whole centimetres."""
    total, at = sum(parts), low
    intervals: list[tuple[float, float]] = []
    for i, part in enumerate(parts):
        end = high if i == len(parts) - 1 else round(at + (high - low) * part / total, 2)
        intervals.append((at, end))
        at = end
    return intervals


def random_cuts(
    low: float, high: float, wanted: tuple[float, float], rng: Generator
) -> list[tuple[float, float]]:
    """Divide the interval (m) into parts of random length, each about as long as the range `wanted`, m."""
    count = max(1, round((high - low) / (sum(wanted) / 2)))
    return cuts(low, high, [float(rng.uniform(*wanted)) for _ in range(count)])
