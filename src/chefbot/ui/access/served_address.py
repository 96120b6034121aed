"""At which address a robot was served to the network last: for invitations, and for programs of its computer."""

from __future__ import annotations

import ipaddress
from collections.abc import Callable
from urllib.parse import parse_qs, urlsplit

from chefbot.storage.atomic_files import StorageError
from chefbot.ui.access.invitations import PEOPLE, page_folder, write_private

ADDRESS = ".address"
"""Ending of the file with the address at which a robot was served to a network last."""
LINK = ".link"
"""Ending of the file with that address and the token of its launch."""


def keep_address(robot: str, link: str, warn: Callable[[str], None]) -> None:
    """Record an address as `write_address` does, or warn that it cannot be written."""
    try:
        write_address(robot, link)
    except StorageError as error:
        warn(str(error))


def write_address(robot: str, link: str) -> None:
    """Record the address at which a robot's web UI is served to the network: without its token for invitations, and
    with it for programs of the same user on this computer."""
    write_private(page_folder() / f"{robot}{ADDRESS}", link.partition("?")[0].encode())
    write_private(page_folder() / f"{robot}{LINK}", link.encode())


def read_address(robot: str) -> str:
    """Return the address at which a robot was served to a network last; empty if it never was."""
    try:
        return (page_folder() / f"{robot}{ADDRESS}").read_text()
    except FileNotFoundError:
        return ""


def own_token(host: str, port: int) -> str:
    """Return the token of the web UI that this user has served to the network at a host of this computer and a port
    last; empty if there was none."""
    links = sorted(page_folder().glob(f"*{LINK}"), key=lambda path: path.stat().st_mtime, reverse=True)
    for parts in map(urlsplit, (path.read_text() for path in links)):
        if parts.port == port and (host == parts.hostname or _is_loopback(host)):
            return parse_qs(parts.query).get("token", [""])[0]
    return ""


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def served_robots() -> list[str]:
    """Return the names of this computer's robots that were served to a network, or to which somebody is invited."""
    files = (path.name for path in page_folder().glob("*.*"))
    return sorted({name.partition(".")[0] for name in files if name.endswith((ADDRESS, PEOPLE))})
