"""The addresses of this machine in its networks."""

from __future__ import annotations

import fcntl
import socket
import struct

SIOCGIFADDR = 0x8915
"""netdevice(7): an interface's IPv4 address; it lies in bytes 20 to 23 of the answer."""


def addresses() -> list[str]:
    """IPv4 address of each interface that has one, loopback aside."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        found = [_address(probe, name) for _, name in socket.if_nameindex()]
    return sorted({address for address in found if address and not address.startswith("127.")})


def _address(probe: socket.socket, interface: str) -> str | None:
    try:
        answer = fcntl.ioctl(probe.fileno(), SIOCGIFADDR, struct.pack("256s", interface.encode()))
    except OSError:
        return None  # it has none, or went away
    return socket.inet_ntoa(answer[20:24])
