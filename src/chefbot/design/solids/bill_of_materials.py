"""The bill of materials: parts with number, material, mass and size; the prices are empty."""

from __future__ import annotations

import csv
import io
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.design.drawing.drawing import loop_box
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.shapes import AXES, Ball, Solid
from chefbot.robot.geometry.solids import RobotPart, solids
from chefbot.robot.spec import Robot

AGREEING_DIGITS = 7
"""Digits in which equal pieces agree; left and right ones are rotated."""
ALL, ASSEMBLY = "all", "assembly"
"""Names that are not parts and can be selected like one."""
HEAD = "part,count,what,material,mass_each_kg,mass_kg,x_mm,y_mm,z_mm,price_each,price"


class Item(NamedTuple):
    """Equal pieces: one of them, the number, its title in a shop (or empty), and the sides of its box, m."""

    name: str
    part: RobotPart
    number: int
    title: str
    size: tuple[float, float, float]

    @property
    def mass(self) -> float:
        """Return the mass of all pieces, kg."""
        return self.number * self.part.mass


def bill(robot: Robot) -> list[Item]:
    """Return all parts of the robot without the payload, in order from the base plate up.

    An item has the name of its kind; where pieces of a kind differ, as stands do in length, the name of its
    first piece.
    """
    groups: dict[tuple[object, ...], list[RobotPart]] = {}
    for part in solids(robot):
        groups.setdefault(_sort(part), []).append(part)
    bought = {"motor": robot.motor.title, "driver": robot.driver.title, "battery": robot.battery.title}
    kinds = [pieces[0].kind for pieces in groups.values()]
    items = []
    for first, *others in groups.values():
        name = first.kind if kinds.count(first.kind) == 1 else first.name
        items.append(Item(name, first, 1 + len(others), bought.get(first.kind, ""), box(first.solids)))
    _check_names([item.name for item in items])
    return items


def _check_names(names: list[str]) -> None:
    """Names must be unique, because files and nodes have them."""
    for name in names:
        if names.count(name) > 1 or name in (ALL, ASSEMBLY):
            raise RobotFileError(f"equipment of the robot file is called {name!r}, which is taken; rename it")


def bill_csv(items: list[Item]) -> bytes:
    """Return a CSV table in millimetres and kilograms with a header and two empty fields for the prices."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(HEAD.split(","))
    for item in items:
        size = [f"{side / 1e-3:.1f}" for side in item.size]
        masses = [f"{item.part.mass:.6f}", f"{item.mass:.6f}"]
        table.writerow([item.name, item.number, item.title, item.part.material, *masses, *size, "", ""])
    return text.getvalue().encode()


def box(pieces: tuple[Solid, ...]) -> tuple[float, float, float]:
    """Return the sides of the exact bounding box of the solids in their frame, m."""
    corners = np.vstack([_ends(piece) for piece in pieces])
    x, y, z = np.ptp(corners, axis=0).tolist()
    return x, y, z


def _sort(part: RobotPart) -> tuple[object, ...]:
    """The same for equal pieces."""
    size = tuple(f"{side:.{AGREEING_DIGITS}g}" for side in sorted(box(part.solids)))
    return (
        part.kind,
        part.material,
        f"{part.mass:.{AGREEING_DIGITS}g}",
        f"{part.volume:.{AGREEING_DIGITS}g}",
        size,
    )


def _ends(solid: Solid) -> NDArray[np.float64]:
    """Two opposite corners (2, 3) of a solid's box."""
    if isinstance(solid, Ball):
        return np.array(solid.at) + solid.radius * np.array([[-1.0], [1.0]])
    left, low, right, high = loop_box(solid.outline.edge)
    ends = np.array([(left, low, -solid.length / 2), (right, high, solid.length / 2)])
    return ends @ AXES[solid.axis].T + np.array(solid.at)
