"""Common parts of robot-file sections: frozen structs in SI units; the file may use any unit."""

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


class RobotSection(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base class of all sections of a robot file."""


class Size(RobotSection, frozen=True, kw_only=True):
    """Side lengths of a box along x, y and z."""

    x: Length
    y: Length
    z: Length


class Offset(RobotSection, frozen=True, kw_only=True):
    """Offset of a box's centre from the origin of its frame."""

    x: Coordinate = 0.0
    y: Coordinate = 0.0
    z: Coordinate = 0.0


class Mount(RobotSection, frozen=True, kw_only=True):
    """Pose of a sensor frame in base_link (origin on the floor below the middle of the axle, x forward)."""

    x: Coordinate
    y: Coordinate = 0.0
    z: Coordinate
    pitch: Angle = 0.0
    """Rotation about +y (REP-103): positive looks down."""
    yaw: Angle = 0.0

    @property
    def planar(self) -> SE2:
        """Pose of the sensor frame projected onto the floor plane."""
        return SE2(self.x, self.y, self.yaw)


class Housing(RobotSection, frozen=True, kw_only=True):
    """Box-shaped housing of a sensor, aligned with the axes of the sensor frame."""

    size: Size
    mass: Mass
    centre: Offset = Offset()


class MountingPosition(RobotSection, frozen=True, kw_only=True):
    """Mounting position of a box: its plate (1 is the lowest) and the position of its centre on it."""

    plate: Annotated[int, Meta(ge=1, le=6)] = 1
    x: Coordinate = 0.0
    y: Coordinate = 0.0
