"""The addresses of this machine in its networks."""

from __future__ import annotations

import socket
import struct
import sys

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

SIOCGIFADDR = 0x8915
"""netdevice(7): an interface's IPv4 address; it lies in bytes 20 to 23 of the answer."""


def addresses() -> list[str]:
    """IPv4 address of each interface that has one, loopback aside; outside of Linux those of the host's name."""
    if fcntl is None or sys.platform != "linux":
        return sorted(one for one in _of_the_name() if not one.startswith("127."))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        found = [_address(probe, name) for _, name in socket.if_nameindex()]
    return sorted({address for address in found if address and not address.startswith("127.")})


def _of_the_name() -> set[str]:
    try:
        found = socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
    except OSError:  # the name is nowhere written down
        return set()
    return {str(address[0]) for *_, address in found}


def _address(probe: socket.socket, interface: str) -> str | None:
    try:
        answer = fcntl.ioctl(probe.fileno(), SIOCGIFADDR, struct.pack("256s", interface.encode()))
    except OSError:
        return None  # it has none, or went away
    return socket.inet_ntoa(answer[20:24])
