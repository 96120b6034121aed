"""A place in a DDS domain, as ROS 2's own processes have it."""

from __future__ import annotations

import os
from typing import Any

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant

from chefbot.errors import UserError

AUTO, LOOPBACK = "auto", "lo"
CONFIGURATION = "CYCLONEDDS_URI"
ENCLAVE = b"enclave=/;"
"""ROS 2 writes it into every participant's user data (rmw_cyclonedds rmw_node.cpp)."""
_GENERAL = '<Interfaces><NetworkInterface name="{}"/></Interfaces>'
_LOCAL = (
    "<CycloneDDS><Domain><General>" + _GENERAL.format(LOOPBACK) + "<AllowMulticast>false</AllowMulticast>"
    "<MaxMessageSize>65500B</MaxMessageSize></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<MaxAutoParticipantIndex>119</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
"""Without multicast, which loopback has not: participants are looked for at their well-known ports."""
_ONE = "<CycloneDDS><Domain><General>" + _GENERAL + "</General></Domain></CycloneDDS>"


def interface_of_environment() -> str:
    """Loopback if ROS 2's own variables keep this user's nodes on the machine, else what Cyclone takes."""
    local_range = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
    return LOOPBACK if local_range or os.environ.get("ROS_LOCALHOST_ONLY") == "1" else AUTO


class Place:
    """A participant in a domain; `interface`: a network interface's name, 'lo', or 'auto' for Cyclone's choice.

    What CYCLONEDDS_URI says goes on top. UserError when DDS cannot be opened so.
    """

    def __init__(self, number: int, interface: str) -> None:
        given = os.environ.get(CONFIGURATION, "")
        self._domain: Any = None
        try:
            if interface != AUTO:
                own = _LOCAL if interface == LOOPBACK else _ONE.format(interface)
                self._domain = Domain(number, ",".join(filter(None, (own, given))))
            self.participant = DomainParticipant(number, Qos(Policy.Userdata(ENCLAVE)))
        except DDSException:
            raise UserError(
                f"DDS domain {number} cannot be opened on interface {interface!r}; `ip link` names the interfaces, "
                f"and what {CONFIGURATION} says must fit"
            ) from None
        self.gid: bytes = self.participant.guid.bytes

    def close(self) -> None:
        """Leave; all that was made in it goes too."""
        self.participant = None
        self._domain = None
