"""Chassis sections of a robot file: body, plates, poles, tubes, motor clamps, wheels and casters."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from chefbot.robot.plate_shape import RectangularPlate, RoundPlate
from chefbot.robot.quantities import (
    Coordinate,
    Length,
    Mass,
    Name,
    Ratio,
)
from chefbot.robot.section import MountingPosition, RobotSection, Size


class Equipment(RobotSection, frozen=True, kw_only=True):
    """A box mounted on a plate, such as a computer or a circuit board."""

    name: Name
    place: MountingPosition
    size: Size
    mass: Mass


class MountingPositions(RobotSection, frozen=True, kw_only=True):
    """Mounting positions of battery and motor driver; their sizes and masses come from their own sections."""

    battery: MountingPosition
    driver: MountingPosition


class Body(RobotSection, frozen=True, kw_only=True):
    """Overall dimensions of a robot made of stacked plates, which are round, or rectangular if they have a length and
    a width instead of a radius."""

    payload: Mass
    payload_height: Length
    """Height of the payload above the top plate."""
    mass_budget: Mass
    """Mass without payload that sizing calculations assume before there is a drawing; the actual mass follows
    from the solids."""
    radius: Length | None = None
    """Radius of round plates."""
    length: Length | None = None
    """Length of rectangular plates, along x."""
    width: Length | None = None
    """Width of rectangular plates, along y."""
    axle_offset: Coordinate = 0.0
    """Distance of the axle in front of the middle of rectangular plates."""
    clearance: Length
    """Required ground clearance of everything but wheels and casters."""

    @property
    def plate(self) -> RoundPlate | RectangularPlate:
        """Shape of the plates, seen from above."""
        if self.length is None or self.width is None:
            return RoundPlate(self.radius or 0.0)
        half = self.length / 2.0
        return RectangularPlate(half - self.axle_offset, half + self.axle_offset, self.width / 2.0)


class Notch(RobotSection, frozen=True, kw_only=True):
    """Cutout for a wheel in the base plate, open to the plate's edge."""

    length: Length
    depth: Length


class Plates(RobotSection, frozen=True, kw_only=True):
    """Discs stacked one above the other; the lowest one has the wheel notches."""

    count: Annotated[int, Meta(ge=1, le=6)]
    thickness: Length
    material: Name
    centre_hole: Length
    """Diameter of the hole for the wiring."""
    screw_hole: Length
    """Diameter of all screw holes."""
    notch: Notch | None = None


class Poles(RobotSection, frozen=True, kw_only=True):
    """Short rods screwed to the plates that hold the ends of the tubes."""

    radius: Length
    height: Length
    reach: Length
    """Distance along x and y: the four poles stand at (+-reach, +-reach)."""
    material: Name


class Tubes(RobotSection, frozen=True, kw_only=True):
    """Spacer tubes between two plates, pushed over the poles."""

    length: Length
    bore: Length
    """Inner diameter."""
    wall: Length
    material: Name

    @property
    def outer_radius(self) -> float:
        """Outer radius of a tube, m: half its bore plus its wall."""
        return self.bore / 2.0 + self.wall


class MotorClamp(RobotSection, frozen=True, kw_only=True):
    """Angle bracket below the base plate: flange screwed to the plate, face holding the motor's front."""

    length: Length
    """Length along the axle."""
    width: Length
    thickness: Length
    material: Name


class Wheels(RobotSection, frozen=True, kw_only=True):
    """The two driven wheels with their tyres."""

    diameter: Length
    width: Length
    separation: Length
    """Distance between the contact points of the two wheels with the floor."""
    mass: Mass
    friction: Ratio
    """Coefficient of friction of the tyre on the floor."""
    gap: Length
    """Distance between a wheel and its motor clamp."""

    @property
    def inner_face(self) -> float:
        """Distance of the wheels' inner faces from the robot's plane of symmetry, metres."""
        return self.separation / 2.0 - self.width / 2.0

    @property
    def outer_face(self) -> float:
        """Distance of the wheels' outer faces from the robot's plane of symmetry, metres."""
        return self.separation / 2.0 + self.width / 2.0


class Casters(RobotSection, frozen=True, kw_only=True):
    """Ball casters in a cup, one in front and one behind."""

    radius: Length
    offset: Length
    """Distance along x from the middle of the axle to a caster."""
    wall: Length
    """Wall thickness of the cup."""
    material: Name
