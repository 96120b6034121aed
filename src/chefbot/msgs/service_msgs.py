"""service_msgs: information on service calls for introspection."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.message import Int64, Message, Uint8

_NO_GID = np.zeros(16, np.uint8)


class ServiceEventInfo(Message, frozen=True, eq=False):
    """The event type, time, client and sequence number of a service call."""

    event_type: Uint8 = 0
    stamp: Time = Time()
    client_gid: Annotated[NDArray[np.uint8], "uint8[16]"] = _NO_GID
    sequence_number: Int64 = 0
