"""service_msgs: information on service calls for introspection."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.message import NIL, Int64, Message, Uint8, Uint8Array16


class ServiceEventInfo(Message, frozen=True, eq=False):
    """The event type, time, client and sequence number of a service call."""

    event_type: Uint8 = 0
    stamp: Time = Time()
    client_gid: Uint8Array16 = NIL
    sequence_number: Int64 = 0
