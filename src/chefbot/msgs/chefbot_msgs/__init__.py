"""chefbot_msgs: message types that ROS 2's own packages do not have."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs.causes import PresentCauses as PresentCauses
from chefbot.msgs.chefbot_msgs.deliveries import Order as Order
from chefbot.msgs.chefbot_msgs.deliveries import RoundForecast as RoundForecast
from chefbot.msgs.chefbot_msgs.deliveries import RoundStop as RoundStop
from chefbot.msgs.chefbot_msgs.launches import LaunchRequest as LaunchRequest
from chefbot.msgs.chefbot_msgs.launches import LaunchStatus as LaunchStatus
from chefbot.msgs.chefbot_msgs.launches import MapFolder as MapFolder
from chefbot.msgs.chefbot_msgs.maps import MapEdit as MapEdit
from chefbot.msgs.chefbot_msgs.maps import MapEditResult as MapEditResult
from chefbot.msgs.chefbot_msgs.maps import MappedScan as MappedScan
from chefbot.msgs.chefbot_msgs.maps import MapStroke as MapStroke
from chefbot.msgs.chefbot_msgs.maps import MapTrajectory as MapTrajectory
from chefbot.msgs.chefbot_msgs.maps import MapZone as MapZone
from chefbot.msgs.chefbot_msgs.maps import MapZones as MapZones
from chefbot.msgs.chefbot_msgs.maps import Place as Place
from chefbot.msgs.chefbot_msgs.maps import Places as Places
from chefbot.msgs.chefbot_msgs.navigation import CostmapCell as CostmapCell
from chefbot.msgs.chefbot_msgs.navigation import CostmapMark as CostmapMark
from chefbot.msgs.chefbot_msgs.navigation import TrajectoryCandidates as TrajectoryCandidates
from chefbot.msgs.chefbot_msgs.people import TrackedPeople as TrackedPeople
from chefbot.msgs.chefbot_msgs.people import TrackedPerson as TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.idl.action import define_action
from chefbot.msgs.idl.constraints import MAX_MAGNITUDE, per_field, same_length
from chefbot.msgs.idl.message import (
    Bool,
    Float32,
    Float32Array,
    Float64,
    Int32,
    Int64,
    Message,
    String,
    StringArray,
    Uint8,
    Uint16,
    Uint32,
)
from chefbot.msgs.sensor_msgs import BEAM_ANGLE, DISTANCE, MAX_BEAMS, at_most_one_turn
from chefbot.msgs.std_msgs import Header

MAX_TICKS = 2**53
"""Maximum tick count: above it a double cannot represent every integer."""
MAX_WHEEL_SPEED = 1e4
"""Upper bound for the angular velocity of a wheel, rad/s."""
_NO_FLOATS = np.empty(0, np.float32)
_NOBODY = np.empty(0, np.uint32)
_ZERO_16 = np.zeros(16)
_ZERO_16.flags.writeable = False


class WheelTicks(Message, frozen=True, eq=False):
    """Tick counts of both wheel encoders, sampled together; they count from the start of the board."""

    BOUNDS = dict.fromkeys(("left", "right"), (-MAX_TICKS, MAX_TICKS))

    header: Header = Header()
    left: Int64 = 0
    right: Int64 = 0


class WheelSpeeds(Message, frozen=True, eq=False):
    """Commanded angular velocities of both wheels, rad/s, positive forward, as of the URDF's wheel joints.

    The wheel radius enters before, where the twist is converted; the board only converts radians to ticks.
    """

    BOUNDS = dict.fromkeys(("left", "right"), (-MAX_WHEEL_SPEED, MAX_WHEEL_SPEED))

    header: Header = Header()
    left: Float64 = 0.0
    right: Float64 = 0.0


class ObstacleScan(Message, frozen=True, eq=False):
    """Obstacles of any height above the floor, seen by a depth camera.

    `ranges[i]`: distance to the nearest obstacle in angular bin i, m, inf for none; from `clear_from[i]` to
    `clear_to[i]` the floor was observed to be free. `bottom[i]` and `top[i]`: height range of the obstacle above the
    floor, m. `lower_to[i]`: end of the lower ground behind a drop-off's edge, m, else 0. Empty: not measured.
    """

    BOUNDS = per_field(angle_min=BEAM_ANGLE, range_max=DISTANCE)
    MAX_LENGTHS = per_field(ranges=MAX_BEAMS)
    RULES = (
        at_most_one_turn,
        same_length("ranges", "clear_from", "clear_to"),
        same_length("ranges", "bottom", "top", "lower_to", may_be_empty=True),
    )

    header: Header = Header()
    angle_min: Float32 = 0.0
    angle_increment: Float32 = 0.0
    range_max: Float32 = 0.0
    ranges: Float32Array = _NO_FLOATS
    clear_from: Float32Array = _NO_FLOATS
    clear_to: Float32Array = _NO_FLOATS
    bottom: Float32Array = _NO_FLOATS
    top: Float32Array = _NO_FLOATS
    lower_to: Float32Array = _NO_FLOATS

    @property
    def angles(self) -> NDArray[np.float64]:
        """Middle of each angular bin in the frame of the header, rad, shape (n,)."""
        bins = np.arange(len(self.ranges), dtype=np.float64)
        return np.asarray(self.angle_min + self.angle_increment * bins)

    def lower_ground(self, longest: float) -> NDArray[np.float64]:
        """Return up to which distance (n,) the ground behind an edge is lower, m, at most `longest`, 0 for none."""
        lower_to = self.lower_to if len(self.lower_to) else np.zeros(len(self.ranges))
        return np.minimum(np.nan_to_num(lower_to, posinf=0.0, neginf=0.0), longest).astype(np.float64)


class LocalizationStatus(Message, frozen=True, eq=False):
    """The quality of the pose estimate, with a description of the state and its cause.

    probability: that the pose is right to within 0.25 m and 10 degrees. std_xy, std_yaw: standard deviations, m, rad.
    """

    BOUNDS = per_field(
        probability=(0.0, 1.0),
        **dict.fromkeys(("std_xy", "std_yaw"), (0.0, MAX_MAGNITUDE)),
    )

    header: Header = Header()
    localized: Bool = False
    probability: Float32 = 0.0
    std_xy: Float32 = 0.0
    std_yaw: Float32 = 0.0
    particles: Uint32 = 0
    description: String = ""


class PatrolOrder(Message, frozen=True, eq=False):
    """An order to drive to places, or through them without stopping.

    `rounds`: how often; 0: until it is cancelled.
    """

    MAX_LENGTHS = per_field(places=1000)

    places: StringArray = ()
    rounds: Uint32 = 1
    without_stops: Bool = False


class FollowOrder(Message, frozen=True, eq=False):
    """An order to follow a tracked person; 0: the nearest one ahead."""

    person: Uint32 = 0


class Errand(Message, frozen=True, eq=False):
    """An order to drive to a pose without food.

    `when`: now (the round waits), after (the round), instead (of the round).
    """

    name: String = ""
    """Display name of the place; empty for a point on the map."""
    pose: PoseStamped = PoseStamped()
    when: String = ""


class DeliveryStatus(Message, frozen=True, eq=False):
    """The complete state of the deliveries, from which a restarted delivery node continues."""

    header: Header = Header()
    state: String = ""
    """idle, loading, driving, waiting, returning, unloading, errand, failed"""
    place: String = ""
    queue: StringArray = ()
    """Places of the current round still to be served after `place`."""
    delivered: StringArray = ()
    """Places of the current round where the food was taken from the tray."""
    description: String = ""
    skipped_reasons: StringArray = ()
    """Reasons why places of the current round were not served, a sentence each."""
    pending_orders: tuple[Order, ...] = ()
    """Accepted orders that wait for the current one."""
    order_id: String = ""
    """The `id` of the current order."""
    accepted: StringArray = ()
    """The `id` of recently accepted orders, the newest last."""
    loaded: Bool = False
    """Whether the food is on the tray."""
    hold_reason: String = ""
    """Reason why the round waits: stop (emergency stop), errand (the first of `errands`), choice (of the
    operator); or empty."""
    errands: tuple[Errand, ...] = ()
    """Errands to be done, in order."""
    places: StringArray = ()
    """Places of the current round, or of the last one, as they were ordered."""
    on_trays: StringArray = ()
    """Places to be served from the trays, by tray, "" for none; empty if the robot carries all food at once."""
    untaken: StringArray = ()
    """Places whose food nobody took and is still on the robot, which returns it to the kitchen."""
    ordered_by: String = ""
    """Person who gave the order of the current round, or of the last one."""
    last_outcome: String = ""
    """How the last round ended, a sentence; empty before the first."""


class EmergencyStopStatus(Message, frozen=True, eq=False):
    """The state of the emergency stop.

    `held`: only the loss of the motor board keeps it active; `pressed_at`: when it was last pressed, 0 if never;
    `description`: the reason.
    """

    header: Header = Header()
    active: Bool = False
    held: Bool = False
    pressed_at: Time = Time()
    description: String = ""


class BatteryStatus(Message, frozen=True, eq=False):
    """What the battery allows, with a description for the operator."""

    header: Header = Header()
    level: String = ""
    """ok, warn, return (the robot goes home), park (only enough to park)"""
    charge: Float32 = 0.0
    """Charge above the voltage at which the motor board stops, 0..1; the more careful of voltage and use."""
    energy: Float32 = 0.0
    """Energy to plan drives with, J, without what is kept for parking."""
    standing_power: Float32 = 0.0
    """Power of the robot while it stands, W."""
    energy_per_metre: Float32 = 0.0
    """Energy of a metre in addition to standing, J."""
    seconds_per_metre: Float32 = 0.0
    """Time that a metre takes on average, s."""
    voltage_fault: String = ""
    """Why the reading of the voltage is rejected, or empty."""
    description: String = ""


class BatteryLog(Message, frozen=True, eq=False):
    """What the battery monitor has learnt and keeps over a restart of the robot."""

    BOUNDS = per_field(charge=(0.0, 1.0), measured=(0.0, 1.0))

    header: Header = Header()
    standing_power: Float64 = 0.0
    energy_per_metre: Float64 = 0.0
    seconds_per_metre: Float64 = 0.0
    charge: Float64 = 0.0
    measured: Float64 = 0.0
    """Charge by the voltage alone."""
    windows: Uint32 = 0
    """Number of parts of the log that were learnt from."""


class NavigationStatus(Message, frozen=True, eq=False):
    """The state of the navigator, and the reason why it last stopped."""

    header: Header = Header()
    state: String = ""
    """idle, driving, recovering, waiting (for a sensor, or for a path that is blocked: `reason` names it)"""
    recoveries: Uint32 = 0
    reason: String = ""


class Quantity(Message, frozen=True, eq=False):
    """A named number with its unit, SI."""

    name: String = ""
    value: Float64 = 0.0
    unit: String = ""


class Cause(Message, frozen=True, eq=False):
    """Why the robot slows down, stops, takes a detour or fails: which check of which node, and what it found where.

    `header.frame_id` is the frame of `point` and `robot`; `header.stamp` is when the effect began or ended.
    """

    header: Header = Header()
    id: Uint32 = 0
    """Number of the cause in this run, from 1 on; 0 in the report of a node. An end has the number of what ends."""
    kind: String = ""
    """slow, stop, detour, failure, or end (of one of these)"""
    node: String = ""
    """Node whose check it is."""
    check: String = ""
    """Check that failed, in words."""
    sensor: String = ""
    """What marked the obstacle: lidar, depth camera, ultrasonic ranger, contact, map, or a zone."""
    located: Bool = False
    """Whether `point` is known."""
    point: Point = Point()
    """Where the obstacle is: the middle of a marked cell, or the measured point, m."""
    marked_at: Time = Time()
    """When it was last marked, 0 if that is not known."""
    obstacle: String = ""
    """What it is: person, on the map, not on the map, or empty for not known."""
    person: Int32 = -1
    """Number of the tracked person, -1 for none."""
    robot: Pose = Pose()
    """Where the robot was, if the frame is known."""
    caused_by: Uint32 = 0
    """The `id` of the cause of another node behind this one, 0 for none."""
    chain: StringArray = ()
    """The chain from this check to its root, a link each."""
    numbers: tuple[Quantity, ...] = ()
    """What the check measured."""
    sentence: String = ""
    """The whole chain in words."""


class ExplorationStatus(Message, frozen=True, eq=False):
    """The progress of exploration; when done, the frontiers that were skipped and why."""

    header: Header = Header()
    done: Bool = False
    frontiers: Uint32 = 0
    description: String = ""
    skipped_frontiers: StringArray = ()


class Collision(Message, frozen=True, eq=False):
    """A contact of the simulated robot with anything but the floor."""

    header: Header = Header()
    object_name: String = ""
    count: Uint32 = 0


class Deliver_Goal(Message, frozen=True, eq=False):
    """Deliver food to these places and return home."""

    places: StringArray = ()


class Deliver_Result(Message, frozen=True, eq=False):
    """The places served; an error code, 0 if all were, and a description."""

    delivered: StringArray = ()
    error_code: Uint16 = 0
    error_msg: String = ""


class Deliver_Feedback(Message, frozen=True, eq=False):
    """A description of what the robot is doing."""

    description: String = ""


class FindBlockage_Goal(Message, frozen=True, eq=False):
    """Find what blocks the path to a pose."""

    goal: PoseStamped = PoseStamped()
    find_waiting_pose: Bool = False
    """Whether to find where to wait until it is gone, too."""


class FindBlockage_Result(Message, frozen=True, eq=False):
    """What blocks the path, tracked people or something that is not on the map; all in the frame map."""

    blocked: Bool = False
    """Whether the shortest path is blocked by what may go away."""
    people: Annotated[NDArray[np.uint32], "uint32[]"] = _NOBODY
    """Numbers of the tracked people who block it; none if it is something else."""
    alternative_path: Bool = False
    """Whether there is a path around it."""
    extra_length: Float64 = 0.0
    """How much longer that is, m."""
    distance: Float64 = 0.0
    """Length of the free path up to it, m."""
    point: Point = Point()
    """The marked cell that blocks it, m."""
    sensor: String = ""
    """What marked the cell, as in Cause."""
    marked_at: Time = Time()
    waiting_pose: PoseStamped = PoseStamped()
    """Where to wait, if that was requested: people can pass the robot there, if there is such a place."""
    goal_occupied: Bool = False
    """Whether the goal is occupied; if the path to it is free, point, sensor and marked_at are of what is there."""


class FindBlockage_Feedback(Message, frozen=True, eq=False):
    """Empty: the search takes a fraction of a second."""

    structure_needs_at_least_one_member: Uint8 = 0


FindBlockage = define_action(FindBlockage_Goal, FindBlockage_Result, FindBlockage_Feedback)
Deliver = define_action(Deliver_Goal, Deliver_Result, Deliver_Feedback)
