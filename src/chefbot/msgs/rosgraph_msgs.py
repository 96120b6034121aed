"""rosgraph_msgs: simulated time."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.message import Message


class Clock(Message, frozen=True, eq=False):
    """The current simulated time, published on /clock."""

    clock: Time = Time()
