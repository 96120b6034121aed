"""Messages of chefbot_msgs about the people around the robot."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import Point, Vector3
from chefbot.msgs.idl.constraints import covariance, per_field
from chefbot.msgs.idl.message import Bool, Float32, Message, Uint32
from chefbot.msgs.std_msgs import Header

_ZERO_16 = np.zeros(16)
_ZERO_16.flags.writeable = False


class TrackedPerson(Message, frozen=True, eq=False):
    """A person with position (m) and velocity (m/s) in the frame of the message, and when it was seen last.

    `covariance`: of x, y, vx, vy, row-major; it grows while the person is not seen. `confidence`: probability that it
    is a person. `visible`: it was seen just now. `last_seen_position`: where that was, at the time `last_seen`.
    """

    ROS_PACKAGE = "chefbot_msgs"

    BOUNDS = per_field(confidence=(0.0, 1.0))
    RULES = (covariance("covariance", 4),)

    id: Uint32 = 0
    """Number of the person, which no other gets before the node starts again; 0 for nobody."""
    position: Point = Point()
    velocity: Vector3 = Vector3()
    covariance: Annotated[NDArray[np.float64], "float64[16]"] = _ZERO_16
    confidence: Float32 = 0.0
    standing: Bool = False
    visible: Bool = False
    last_seen: Time = Time()
    last_seen_position: Point = Point()


class TrackedPeople(Message, frozen=True, eq=False):
    """All people around the robot, in the order of their numbers."""

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(people=1000)

    header: Header = Header()
    people: tuple[TrackedPerson, ...] = ()
