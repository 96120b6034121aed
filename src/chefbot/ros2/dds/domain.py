"""A participant in a DDS domain, configured like those of ROS 2 processes."""

from __future__ import annotations

import os
from typing import Any

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant

from chefbot.errors import ChefbotError

AUTO, LOOPBACK = "auto", "lo"
CONFIGURATION = "CYCLONEDDS_URI"
ENCLAVE = b"enclave=/;"
"""User data that ROS 2 sets on every participant (rmw_cyclonedds rmw_node.cpp)."""
_GENERAL = '<Interfaces><NetworkInterface name="{}"/></Interfaces>'
_LOCAL = (
    "<CycloneDDS><Domain><General>" + _GENERAL.format(LOOPBACK) + "<AllowMulticast>false</AllowMulticast>"
    "<MaxMessageSize>65500B</MaxMessageSize></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<MaxAutoParticipantIndex>119</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
"""Configuration without multicast, which loopback lacks: peers are found at their well-known ports."""
_SINGLE_INTERFACE = "<CycloneDDS><Domain><General>" + _GENERAL + "</General></Domain></CycloneDDS>"


class DdsError(ChefbotError):
    """A DDS domain that cannot be joined with the present settings."""


def interface_from_environment() -> str:
    """Return loopback if ROS 2's variables restrict discovery to this machine, else Cyclone's default."""
    local_range = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
    return LOOPBACK if local_range or os.environ.get("ROS_LOCALHOST_ONLY") == "1" else AUTO


class DdsParticipant:
    """A participant in a DDS domain.

    `interface` is a network interface's name, 'lo', or 'auto' for Cyclone's choice. Settings in
    CYCLONEDDS_URI are applied on top. Raises DdsError when DDS cannot be opened that way.
    """

    def __init__(self, number: int, interface: str) -> None:
        user_config = os.environ.get(CONFIGURATION, "")
        self._domain: Any = None
        try:
            if interface != AUTO:
                config = _LOCAL if interface == LOOPBACK else _SINGLE_INTERFACE.format(interface)
                self._domain = Domain(number, ",".join(filter(None, (config, user_config))))
            self.participant = DomainParticipant(number, Qos(Policy.Userdata(ENCLAVE)))
        except DDSException:
            raise DdsError(
                f"DDS domain {number} cannot be opened on interface {interface!r}; `ip link` names the interfaces, "
                f"and the settings in {CONFIGURATION} must fit"
            ) from None

    def close(self) -> None:
        """Delete the participant and all entities created in it."""
        self.participant = None
        self._domain = None
