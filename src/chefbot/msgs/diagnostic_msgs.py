"""diagnostic_msgs: how the parts are."""

from __future__ import annotations

from chefbot.msgs.idl.message import Byte, Message, String
from chefbot.msgs.std_msgs import Header

OK, WARN, ERROR, STALE = range(4)


class KeyValue(Message, frozen=True, eq=False):
    """A named value."""

    key: String = ""
    value: String = ""


class DiagnosticStatus(Message, frozen=True, eq=False):
    """One part's state, in words."""

    level: Byte = 0
    name: String = ""
    message: String = ""
    hardware_id: String = ""
    values: tuple[KeyValue, ...] = ()


class DiagnosticArray(Message, frozen=True, eq=False):
    """The state of several parts."""

    header: Header = Header()
    status: tuple[DiagnosticStatus, ...] = ()
