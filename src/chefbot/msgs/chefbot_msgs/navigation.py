"""Messages of chefbot_msgs that show how the navigation decides."""

from __future__ import annotations

import numpy as np

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import Point, Pose, Twist
from chefbot.msgs.idl.constraints import per_field, same_length
from chefbot.msgs.idl.message import Bool, Float32, Float64Array, Message, String, Uint8
from chefbot.msgs.std_msgs import Header

MAX_CANDIDATES = 10_000
_EMPTY = np.zeros(0)
_EMPTY.flags.writeable = False


class CostmapMark(Message, frozen=True, eq=False):
    """What marked a cell of a costmap: a sensor, a zone or the map, and when it did so last; 0 for what lasts."""

    ROS_PACKAGE = "chefbot_msgs"

    source: String = ""
    marked_at: Time = Time()


class CostmapCell(Message, frozen=True, eq=False):
    """A cell of the global costmap, as the answer to a point on `clicked_point`.

    `point`: the centre of the cell, and `resolution`, its size, m. `inside`: false if the point is outside the
    costmap. `cost`: 0 free, 253 within the inscribed radius of an obstacle, 254 an obstacle, 255 unknown.
    """

    ROS_PACKAGE = "chefbot_msgs"

    header: Header = Header()
    point: Point = Point()
    resolution: Float32 = 0.0
    inside: Bool = False
    cost: Uint8 = 0
    marks: tuple[CostmapMark, ...] = ()


class TrajectoryCandidates(Message, frozen=True, eq=False):
    """The velocities that the controller compared in a cycle, and their scores; empty if it compared none.

    `pose`: of the robot then, in the frame of the header. `present`: its velocity then, from which each trajectory
    ramps to a velocity of `linear` (m/s) and `angular` (rad/s). `scores`: lower is better, infinite where the robot
    could not stop in time. `duration`: of the trajectories, s.
    """

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(linear=MAX_CANDIDATES)
    RULES = (same_length("linear", "angular", "scores"),)

    header: Header = Header()
    pose: Pose = Pose()
    present: Twist = Twist()
    linear: Float64Array = _EMPTY
    angular: Float64Array = _EMPTY
    scores: Float64Array = _EMPTY
    duration: Float32 = 0.0
