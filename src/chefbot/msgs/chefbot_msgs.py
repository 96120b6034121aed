"""chefbot_msgs: what ROS 2 has no message for."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

import numpy as np

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.idl.action import define_action
from chefbot.msgs.idl.message import (
    Bool,
    Float32,
    Float32Array,
    Float64,
    Int64,
    Message,
    String,
    StringArray,
    Uint16,
    Uint32,
)
from chefbot.msgs.std_msgs import Header

_NO_FLOATS = np.empty(0, np.float32)


class WheelTicks(Message, frozen=True, eq=False):
    """Both encoders, read together; counted since the board began."""

    header: Header = Header()
    left: Int64 = 0
    right: Int64 = 0


class WheelSpeeds(Message, frozen=True, eq=False):
    """Rim speeds that the board shall hold, m/s."""

    header: Header = Header()
    left: Float64 = 0.0
    right: Float64 = 0.0


class ObstacleScan(Message, frozen=True, eq=False):
    """What a depth camera sees of obstacles of any height, over the floor.

    `ranges[i]` metres to the nearest obstacle in bin i, inf for none; the floor was seen free from
    `clear_from[i]` to `clear_to[i]`. The obstacle was seen between `bottom[i]` and `top[i]` metres above the floor;
    both empty: nobody measured them.
    """

    header: Header = Header()
    angle_min: Float32 = 0.0
    angle_increment: Float32 = 0.0
    range_max: Float32 = 0.0
    ranges: Float32Array = _NO_FLOATS
    clear_from: Float32Array = _NO_FLOATS
    clear_to: Float32Array = _NO_FLOATS
    bottom: Float32Array = _NO_FLOATS
    top: Float32Array = _NO_FLOATS


class LocalizationStatus(Message, frozen=True, eq=False):
    """How sure the robot is of its pose; `sentence` says it in words."""

    header: Header = Header()
    localized: Bool = False
    confidence: Float32 = 0.0
    std_xy: Float32 = 0.0
    std_yaw: Float32 = 0.0
    particles: Uint32 = 0
    sentence: String = ""


class Place(Message, frozen=True, eq=False):
    """A named pose on the map."""

    name: String = ""
    pose: PoseStamped = PoseStamped()


class Places(Message, frozen=True, eq=False):
    """All named poses."""

    places: tuple[Place, ...] = ()


class Order(Message, frozen=True, eq=False):
    """Carry food to these places, one after the other. Said twice with one `id` it is one; empty: never the same."""

    places: StringArray = ()
    id: String = ""


class Errand(Message, frozen=True, eq=False):
    """A drive to a pose that carries no food; `when`: now (a round waits), after (the round), instead (of it)."""

    name: String = ""
    """How people call the place; empty for a point on the map."""
    pose: PoseStamped = PoseStamped()
    when: String = ""


class DeliveryStatus(Message, frozen=True, eq=False):
    """The whole state of the deliveries: a restarted delivery node continues from it."""

    header: Header = Header()
    state: String = ""
    """idle, loading, driving, waiting, returning, errand, failed"""
    place: String = ""
    queue: StringArray = ()
    """Places that this round still has to serve after `place`."""
    delivered: StringArray = ()
    """Places of this round where the food was taken."""
    sentence: String = ""
    missed: StringArray = ()
    """Of this round: why a place was not served, a sentence each."""
    orders: tuple[Order, ...] = ()
    """Accepted, and waiting for the one in hand."""
    order_id: String = ""
    """The `id` of the order in hand."""
    accepted: StringArray = ()
    """The `id` of the orders that were accepted lately, the newest last."""
    loaded: Bool = False
    """Whether the food is on the tray."""
    held: String = ""
    """Why the round waits: stop (is pressed), errand (the first of `errands`), choice (of a person); or empty."""
    errands: tuple[Errand, ...] = ()
    """Where it is sent besides: in their turn."""


class StopStatus(Message, frozen=True, eq=False):
    """What the base knows of STOP: `sentence` says why; `pressed_at` when it was pressed last, 0 if never."""

    header: Header = Header()
    stopped: Bool = False
    pressed_at: Time = Time()
    sentence: String = ""


class NavigationStatus(Message, frozen=True, eq=False):
    """What the navigator is doing, and why it last stopped."""

    header: Header = Header()
    state: String = ""
    """idle, driving, recovering, waiting (for a sensor: `reason` names it)"""
    recoveries: Uint32 = 0
    reason: String = ""


class ExplorationStatus(Message, frozen=True, eq=False):
    """How far exploration is; when done, what is left and why."""

    header: Header = Header()
    done: Bool = False
    frontiers: Uint32 = 0
    sentence: String = ""
    left: StringArray = ()


class Collision(Message, frozen=True, eq=False):
    """A contact of the simulated robot with something but the floor."""

    header: Header = Header()
    touched: String = ""
    count: Uint32 = 0


class Deliver_Goal(Message, frozen=True, eq=False):
    """Carry food to these places and come home."""

    places: StringArray = ()


class Deliver_Result(Message, frozen=True, eq=False):
    """What was delivered; 0, or why not all."""

    delivered: StringArray = ()
    error_code: Uint16 = 0
    error_msg: String = ""


class Deliver_Feedback(Message, frozen=True, eq=False):
    """What it is doing."""

    sentence: String = ""


Deliver = define_action(Deliver_Goal, Deliver_Result, Deliver_Feedback)
