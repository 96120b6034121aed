"""What the sections of a robot file have in common: frozen values in SI units; the file may use any unit."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.se2 import SE2
from chefbot.robot.quantities import (
    Angle,
    Coordinate,
    Length,
    Mass,
)


class Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A section of the robot file."""


class Size(Part, frozen=True, kw_only=True):
    """A box's sides along x, y and z."""

    x: Length
    y: Length
    z: Length


class Offset(Part, frozen=True, kw_only=True):
    """From the frame's origin to a box's middle."""

    x: Coordinate = 0.0
    y: Coordinate = 0.0
    z: Coordinate = 0.0


class Mount(Part, frozen=True, kw_only=True):
    """Where a sensor sits: its frame in base_link (on the floor below the axle's middle; x forward)."""

    x: Coordinate
    y: Coordinate = 0.0
    z: Coordinate
    pitch: Angle = 0.0
    """Positive looks down (REP-103: about +y)."""
    yaw: Angle = 0.0

    @property
    def planar(self) -> SE2:
        """The frame seen from above."""
        return SE2(self.x, self.y, self.yaw)


class Housing(Part, frozen=True, kw_only=True):
    """The box that a sensor is in, along the axes of the sensor's frame."""

    size: Size
    mass: Mass
    centre: Offset = Offset()


class Place(Part, frozen=True, kw_only=True):
    """Where a box stands: on which plate (1 is the lowest) and its middle seen from above."""

    plate: Annotated[int, Meta(ge=1, le=6)] = 1
    x: Coordinate = 0.0
    y: Coordinate = 0.0
