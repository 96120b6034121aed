"""Addresses of a web UI: where it listens, and by what names and addresses others reach it."""

from __future__ import annotations

import errno
import ipaddress
import socket

from chefbot.errors import UserError

PORTS_TO_TRY = 20
"""Number of consecutive ports that are tried."""


def listening_socket(host: str, port: int) -> socket.socket:
    """Return a listening socket on the first free port from `port` on."""
    for candidate in range(port, min(port + PORTS_TO_TRY, 65536)):
        listener = _bind(host, candidate)
        if listener is not None:
            return listener
    raise UserError(
        f"Ports {port} to {port + PORTS_TO_TRY - 1} of {host} are all in use; choose another port"
    )


def _bind(host: str, port: int) -> socket.socket | None:
    """Return a listening socket, or None when the port is in use."""
    try:
        return socket.create_server((host, port), family=_family(host), backlog=64)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            return None
        raise UserError(f"The web UI cannot be served at {host}:{port}: {error.strerror or error}") from None


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def own_address() -> str:
    """Return this machine's network address (from a UDP socket that sends nothing); loopback without a
    network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        try:
            udp.connect(("192.0.2.1", 9))
        except OSError:
            return "127.0.0.1"
        return str(udp.getsockname()[0])


def is_loopback(host: str) -> bool:
    """Return whether a host is this computer only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def host_names() -> set[str]:
    """Return the names of this computer on its network: its own, and that of mDNS (RFC 6762), as `robot.local`."""
    name = socket.gethostname().partition(".")[0].lower()
    return {name, f"{name}.local"}
