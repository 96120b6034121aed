"""people_msgs: detected people, as ROS's leg detectors publish them and social costmap layers read them."""

from __future__ import annotations

from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.idl.constraints import per_field, same_length
from chefbot.msgs.idl.message import Float64, Message, String, StringArray
from chefbot.msgs.std_msgs import Header


class Person(Message, frozen=True, eq=False):
    """A person: position (m) and velocity (m/s) in the frame of the message, and the probability that it is one."""

    BOUNDS = per_field(reliability=(0.0, 1.0))
    RULES = (same_length("tagnames", "tags"),)

    name: String = ""
    position: Point = Point()
    velocity: Point = Point()
    reliability: Float64 = 0.0
    tagnames: StringArray = ()
    tags: StringArray = ()


class People(Message, frozen=True, eq=False):
    """All people in one frame."""

    MAX_LENGTHS = per_field(people=1000)

    header: Header = Header()
    people: tuple[Person, ...] = ()
