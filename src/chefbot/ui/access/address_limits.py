"""Limits of connections per address, decided before anything of a connection is read.

A connection is a stranger's until its first valid request. Strangers are limited in number and rate per address,
and a new one replaces the oldest of the address with the most. So slow connections cost only those who hold them,
even if operators share their address (NAT, proxy, this computer). Addresses of valid requests may connect more often.
"""

from __future__ import annotations

import ipaddress
from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

C = TypeVar("C", bound=Hashable)

MAX_STRANGERS = 64
"""Maximum number of connections without a valid request."""
MAX_STRANGERS_PER_ADDRESS, MAX_STRANGERS_PER_KNOWN_ADDRESS = 12, 32
"""Maximum number of those of one address, and of one from which valid requests came: a browser opens six."""
MAX_VISITORS = 128
"""Maximum number of connections with a valid request, without web sockets; idle ones end after 5 s anyway."""
RATE, BURST = 10.0, 40.0
"""New connections per second of an address, and how many at once."""
KNOWN_RATE, KNOWN_BURST = 100.0, 400.0
"""The same for an address from which valid requests came."""
KNOWN_TIME = 600.0
"""Time after the last valid request for which an address is known, s."""
MAX_ADDRESSES = 1024
"""Number of addresses that are remembered."""
LOOPBACK = "loopback"
"""Group of all loopback addresses."""


def address_group(host: str) -> str:
    """Return the group of an address that is limited together: IPv4 addresses each for itself, IPv6 by /64, the
    size of one network of a household."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    if isinstance(address, ipaddress.IPv6Address):
        address = address.ipv4_mapped or address
    if address.is_loopback:
        return LOOPBACK
    if isinstance(address, ipaddress.IPv6Address):
        return str(ipaddress.IPv6Network((address, 64), strict=False))
    return str(address)


@dataclass
class _Address:
    """State of one group of addresses: a token bucket, and until when it is known."""

    tokens: float = BURST
    updated: float = 0.0
    known_until: float = 0.0

    def take(self, now: float) -> bool:
        """Take a token and return whether there was one."""
        known = now < self.known_until
        rate, burst = (KNOWN_RATE, KNOWN_BURST) if known else (RATE, BURST)
        self.tokens = min(burst, self.tokens + (now - self.updated) * rate)
        self.updated = now
        if self.tokens < 1.0:
            return False
        self.tokens -= 1.0
        return True


@dataclass
class AddressLimits(Generic[C]):
    """Decides which connections stay; times are in seconds of one monotonic clock.

    `C` identifies a connection. Methods that return connections leave it to the caller to end them.
    """

    refused: int = 0
    """Number of connections that were refused or replaced."""
    _strangers: dict[C, str] = field(default_factory=dict)
    _visitors: dict[C, str] = field(default_factory=dict)
    _addresses: OrderedDict[str, _Address] = field(default_factory=OrderedDict)

    def may_connect(self, host: str, now: float) -> bool:
        """Return whether an address may make a new connection now, and count it."""
        allowed = self._address(address_group(host), now).take(now)
        self.refused += not allowed
        return allowed

    def add(self, connection: C, host: str, now: float) -> list[C]:
        """Add a stranger's connection; return those that it replaces."""
        group = address_group(host)
        self._strangers[connection] = group
        known = now < self._address(group, now).known_until
        limit = MAX_STRANGERS_PER_KNOWN_ADDRESS if known else MAX_STRANGERS_PER_ADDRESS
        if list(self._strangers.values()).count(group) > limit:
            return self._drop_oldest(self._strangers, group)
        if len(self._strangers) > MAX_STRANGERS:
            return self._drop_oldest(self._strangers, _largest(self._strangers))
        return []

    def recognize(self, connection: C, now: float) -> list[C]:
        """Count a connection as a visitor's from its first valid request on; return those that it replaces."""
        group = self._strangers.pop(connection, None)
        if group is None:
            return []
        address = self._address(group, now)
        address.known_until = max(address.known_until, now + KNOWN_TIME)
        self._visitors[connection] = group
        if len(self._visitors) > MAX_VISITORS:
            return self._drop_oldest(self._visitors, _largest(self._visitors))
        return []

    def is_stranger(self, connection: C) -> bool:
        """Return whether the connection is there without a valid request."""
        return connection in self._strangers

    def remove(self, connection: C) -> None:
        """Forget a connection that has ended or has become a web socket, which has a place of its own."""
        self._strangers.pop(connection, None)
        self._visitors.pop(connection, None)

    def _drop_oldest(self, connections: dict[C, str], group: str) -> list[C]:
        """Remove the oldest connection of a group and return it."""
        oldest = next(connection for connection, of in connections.items() if of == group)
        del connections[oldest]
        self.refused += 1
        return [oldest]

    def _address(self, group: str, now: float) -> _Address:
        """Return the state of a group; the one that was used longest ago is forgotten."""
        if group not in self._addresses:
            self._addresses[group] = _Address(updated=now)
            if (
                group == LOOPBACK
            ):  # users of this computer are known: its owner must not be limited by accident
                self._addresses[group] = _Address(KNOWN_BURST, now, float("inf"))
        self._addresses.move_to_end(group)
        while len(self._addresses) > MAX_ADDRESSES:
            self._addresses.popitem(last=False)
        return self._addresses[group]


def _largest(connections: dict[C, str]) -> str:
    """Return the group with the most connections."""
    groups = list(connections.values())
    return max(dict.fromkeys(groups), key=groups.count)
