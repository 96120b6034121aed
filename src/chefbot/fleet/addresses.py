"""IPv4 addresses of this machine in its networks."""

from __future__ import annotations

import socket
import struct
import sys

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

SIOCGIFADDR = 0x8915
"""netdevice(7): ioctl that returns an interface's IPv4 address in bytes 20 to 23 of the response."""


def addresses() -> list[str]:
    """Return the IPv4 address of each interface that has one, without loopback.

    Outside Linux these are the addresses of the host name.
    """
    if fcntl is None or sys.platform != "linux":
        return sorted(address for address in _hostname_addresses() if not address.startswith("127."))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        found = [_address(probe, name) for _, name in socket.if_nameindex()]
    return sorted({address for address in found if address and not address.startswith("127.")})


def _hostname_addresses() -> set[str]:
    try:
        found = socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
    except OSError:  # the host name does not resolve
        return set()
    return {str(address[0]) for *_, address in found}


def _address(probe: socket.socket, interface: str) -> str | None:
    try:
        answer = fcntl.ioctl(probe.fileno(), SIOCGIFADDR, struct.pack("256s", interface.encode()))
    except OSError:
        return None  # it has no address, or was removed
    return socket.inet_ntoa(answer[20:24])
