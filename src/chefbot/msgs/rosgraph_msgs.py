"""rosgraph_msgs: simulated time."""

from __future__ import annotations

from chefbot.msgs.base import Message
from chefbot.msgs.builtin_interfaces import Time


class Clock(Message, frozen=True, eq=False):
    """Now."""

    clock: Time = Time()
