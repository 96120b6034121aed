"""Sections of a robot file that say what stands on wheels: body, plates, poles, clamps, wheels, casters."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from chefbot.robot.quantities import (
    Length,
    Mass,
    Name,
    Ratio,
)
from chefbot.robot.section import Part, Place, Size


class Equipment(Part, frozen=True, kw_only=True):
    """A computer, a board, a box of cables: something on a plate."""

    name: Name
    place: Place
    size: Size
    mass: Mass


class Places(Part, frozen=True, kw_only=True):
    """Where battery and motor driver stand; what they measure and weigh is theirs."""

    battery: Place
    driver: Place


class Body(Part, frozen=True, kw_only=True):
    """A round robot of stacked plates."""

    payload: Mass
    payload_height: Length
    """What stands on the top plate rises so far above it."""
    mass_budget: Mass
    """The sums before there is a drawing assume so much without payload; the solids tell what it became."""
    radius: Length
    """Of the plates."""
    clearance: Length
    """Wanted below everything but wheels and casters."""


class Notch(Part, frozen=True, kw_only=True):
    """Where a wheel passes the base plate: open to the plate's edge."""

    length: Length
    depth: Length


class Plates(Part, frozen=True, kw_only=True):
    """Discs, one above the other; the lowest has the notches."""

    count: Annotated[int, Meta(ge=1, le=6)]
    thickness: Length
    material: Name
    centre_hole: Length
    """Diameter, for the wiring."""
    screw_hole: Length
    """Diameter of all screw holes."""
    notch: Notch | None = None


class Poles(Part, frozen=True, kw_only=True):
    """Short rods screwed to the plates; they hold the tubes' ends."""

    radius: Length
    height: Length
    reach: Length
    """The four stand at (+-reach, +-reach)."""
    material: Name


class Tubes(Part, frozen=True, kw_only=True):
    """Between two plates, over the poles."""

    length: Length
    bore: Length
    """Diameter inside."""
    wall: Length
    material: Name


class MotorClamp(Part, frozen=True, kw_only=True):
    """An angle below the base plate: the flange is screwed to it, the face holds the motor's front."""

    length: Length
    """Along the axle."""
    width: Length
    thickness: Length
    material: Name


class Wheels(Part, frozen=True, kw_only=True):
    """The two driven wheels."""

    diameter: Length
    width: Length
    separation: Length
    """Between the two points that touch the floor."""
    mass: Mass
    friction: Ratio
    """Of the tyre on the floor."""
    gap: Length
    """Between a wheel and its motor clamp."""


class Casters(Part, frozen=True, kw_only=True):
    """A ball in a cup in front, another behind."""

    radius: Length
    offset: Length
    """Axle's middle to caster, along x."""
    wall: Length
    """Of the cup."""
    material: Name
