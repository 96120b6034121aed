"""World files: schema of rooms, furniture, doors, people and named places."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from chefbot.buildings.people_spec import Count, PeopleSpec
from chefbot.maths.se2 import SE2
from chefbot.robot.quantities import Name
from chefbot.robot.sensors import TAG_SQUARES, TagFamily

Coordinate = Annotated[float, Meta(ge=-200, le=200, extra={"unit": "m"})]
Length = Annotated[float, Meta(gt=0, le=200, extra={"unit": "m"})]
Height = Annotated[float, Meta(ge=0, le=20, extra={"unit": "m"})]
Angle = Annotated[float, Meta(ge=-2 * math.pi, le=2 * math.pi, extra={"unit": "rad"})]
Speed = Annotated[float, Meta(gt=0, le=3, extra={"unit": "m/s"})]
Fraction = Annotated[float, Meta(ge=0, le=1)]
Point = Annotated[list[Coordinate], Meta(min_length=2, max_length=2)]
Material = Literal["solid", "glass", "mirror"]
"""What light meets at a surface: it is scattered, passes, or is reflected."""
HexColour = Annotated[str, Meta(pattern=r"^#[0-9a-fA-F]{6}$")]


class Element(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base class of the sections of a world file."""


class Opening(Element, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An opening in a wall: a passage, or a window if it has a sill."""

    at: Annotated[float, Meta(ge=0, le=200, extra={"unit": "m"})]
    """Distance of the opening's centre from the wall's `start`."""
    width: Length
    sill: Height = 0.0
    height: Height = 2.1
    """Height of the upper edge above the floor."""


class Wall(Element, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A straight wall; `start` and `end` lie on its centre line."""

    start: Point
    end: Point
    thickness: Length = 0.12
    height: Length = 2.5
    openings: Annotated[list[Opening], Meta(max_length=100)] = []
    material: Material = "solid"
    colour: HexColour = "#d8d2c4"


class PosedElement(Element, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base class of objects with a pose on the floor."""

    x: Coordinate
    y: Coordinate
    yaw: Angle = 0.0

    @property
    def pose(self) -> SE2:
        """Pose of the object's frame in the world."""
        return SE2(self.x, self.y, self.yaw)


class Table(PosedElement, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table on four legs, with chairs around it."""

    name: Name
    shape: Literal["square", "round"] = "square"
    size: Length = 0.8
    """Diameter, or side length along the table's own x axis."""
    depth: Length | None = None
    """Side length along its y axis, if it is not square."""
    height: Length = 0.74
    chairs: Annotated[list[Angle], Meta(max_length=12)] = []
    """Bearings of the chairs from the table's centre; each chair faces the table."""
    colour: HexColour = "#a5713c"


class Chair(PosedElement, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A chair on four legs that faces along its x axis."""

    colour: HexColour = "#6e4a2a"


class BoxSpec(PosedElement, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A box such as a bed, counter, cupboard or fridge."""

    name: Name
    size: Annotated[list[Length], Meta(min_length=3, max_length=3)]
    """Side lengths along its own x and y axes, and its height."""
    bottom: Height = 0.0
    material: Material = "solid"
    colour: HexColour = "#9a8f80"


class Cylinder(Element, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An upright cylinder such as a column, plant pot or lamp."""

    name: Name
    x: Coordinate
    y: Coordinate
    radius: Length
    height: Length
    bottom: Height = 0.0
    colour: HexColour = "#5f7f4f"


class Door(PosedElement, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A door leaf that closes an opening; (x, y) is the hinge, and a closed leaf lies along its own x axis.

    A hinged leaf swings by `swing` when open; a sliding one moves back by its own width.
    """

    name: Name
    kind: Literal["hinge", "slide"] = "hinge"
    width: Length
    swing: Angle = math.pi / 2
    open: Fraction = 1.0
    thickness: Length = 0.04
    height: Length = 2.05
    colour: HexColour = "#8a5a33"


class FloorHole(Element, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A rectangular hole in the floor, such as a step down or a stairwell, with sides along the axes."""

    name: Name
    x: Coordinate
    y: Coordinate
    size: Annotated[list[Length], Meta(min_length=2, max_length=2)]
    """Side lengths along x and y."""
    depth: Length


class WallTag(PosedElement, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An AprilTag on a thin board; its frame is in the middle of the front, x out of it."""

    family: TagFamily = "tag36h11"
    id: Annotated[int, Meta(ge=0, le=100_000)]
    """Number of the tag in its family."""
    size: Length
    """Side of the outer edge of the black square."""
    z: Height
    """Height of its centre above the floor."""

    @property
    def board_size(self) -> float:
        """Side of the board, m: the black square has a white border of one of its squares."""
        squares = TAG_SQUARES[self.family]
        return self.size * (squares + 2) / squares


class Carpet(PosedElement, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A rectangular piece of floor with another friction."""

    size: Annotated[list[Length], Meta(min_length=2, max_length=2)]
    """Side lengths along its own x and y axes."""
    friction: Annotated[float, Meta(ge=0.05, le=2.0)]
    """Coefficient of sliding friction of a wheel on it."""
    colour: HexColour = "#8c4a4a"


class Route(Element, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A route whose points are where people like to go."""

    points: Annotated[list[Point], Meta(min_length=2, max_length=100)]
    speed: Speed = 0.8
    """Highest speed on the way to its points."""


class NamedPose(PosedElement, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A named pose for the robot."""


class WorldSpec(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The contents of a world file."""

    name: Name
    ceiling: Annotated[float, Meta(gt=0, le=20, extra={"unit": "m"})] | None = None
    walls: Annotated[list[Wall], Meta(max_length=2000)] = []
    tables: Annotated[list[Table], Meta(max_length=500)] = []
    chairs: Annotated[list[Chair], Meta(max_length=2000)] = []
    boxes: Annotated[list[BoxSpec], Meta(max_length=5000)] = []
    cylinders: Annotated[list[Cylinder], Meta(max_length=5000)] = []
    doors: Annotated[list[Door], Meta(max_length=100)] = []
    holes: Annotated[list[FloorHole], Meta(max_length=100)] = []
    carpets: Annotated[list[Carpet], Meta(max_length=100)] = []
    tags: Annotated[list[WallTag], Meta(max_length=100)] = []
    routes: Annotated[list[Route], Meta(max_length=100)] = []
    people: Count | PeopleSpec = 0
    """Number of people, or who they are."""
    places: dict[Name, NamedPose]
