"""Messages of chefbot_msgs about orders and when a delivery round reaches its stops."""

from __future__ import annotations

from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Bool, Float32, Message, String, StringArray
from chefbot.msgs.std_msgs import Header


class Order(Message, frozen=True, eq=False):
    """An order to deliver food to places, in order.

    A second message with the same `id` is the same order; orders with an empty `id` are always distinct.
    """

    ROS_PACKAGE = "chefbot_msgs"

    places: StringArray = ()
    id: String = ""
    ordered_by: String = ""
    """Name or role of the person; empty for another program."""


NOT_TAKEN, LEFT_OUT = "nobody took the food", "it was taken out of the round"
ENDED_BEFORE = "the round was ended before it was served"
BY_PERSONS = (NOT_TAKEN, ENDED_BEFORE, LEFT_OUT)
"""Ends of the reasons in DeliveryStatus that persons and not the robot are responsible for."""


class RoundStop(Message, frozen=True, eq=False):
    """A stop that is left of a round: distance to it (m) and time until the arrival (s), over the stops before."""

    ROS_PACKAGE = "chefbot_msgs"

    BOUNDS = per_field(distance=(0.0, 1e6), time=(0.0, 1e7), charge=(-1.0, 1.0))

    place: String = ""
    distance: Float32 = 0.0
    time: Float32 = 0.0
    charge: Float32 = -1.0
    """Charge of the battery on arrival, 0..1; negative if the battery is not monitored."""
    reachable: Bool = True
    """Whether the map shows a path; otherwise the forecast leaves the stop out, and its values are 0."""


class RoundForecast(Message, frozen=True, eq=False):
    """The stops that are left of the current round, in order, the last one at home; none without a round.

    Also none where the map, the pose or a place is not known. Times are those of a robot that continues at once,
    if the round is held.
    """

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(stops=100)

    header: Header = Header()
    order_id: String = ""
    stops: tuple[RoundStop, ...] = ()
