"""diagnostic_msgs: the status of components."""

from __future__ import annotations

from chefbot.msgs.idl.message import Byte, Message, String
from chefbot.msgs.std_msgs import Header

OK, WARN, ERROR, STALE = range(4)


class KeyValue(Message, frozen=True, eq=False):
    """A named value that belongs to a diagnostic status."""

    key: String = ""
    value: String = ""


class DiagnosticStatus(Message, frozen=True, eq=False):
    """The status of one component: level, description and values."""

    level: Byte = 0
    name: String = ""
    message: String = ""
    hardware_id: String = ""
    values: tuple[KeyValue, ...] = ()


class DiagnosticArray(Message, frozen=True, eq=False):
    """The status of several components at one time."""

    header: Header = Header()
    status: tuple[DiagnosticStatus, ...] = ()
