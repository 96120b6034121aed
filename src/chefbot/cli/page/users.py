"""`chefbot page invite`, `users` and `revoke`: who has a lasting link to a robot's web UI."""

from __future__ import annotations

from datetime import datetime
from urllib.parse import urlsplit

from rich.cells import cell_len, set_cell_size
from rich.console import Console

from chefbot.cli.drive.recorded_robot import local_time, recorded_robot
from chefbot.errors import UserError, name_hint
from chefbot.robot.load import load_robot
from chefbot.ui.access.addresses import own_address
from chefbot.ui.access.audit_log import audit_path, read_entries
from chefbot.ui.access.invitations import Invitations, page_folder
from chefbot.ui.access.roles import ROLES
from chefbot.ui.access.served_address import read_address, served_robots
from chefbot.ui.qr import qr_code

DEFAULT_PORT = 8080
"""Port in the link of a robot that was not served to a network yet."""

console = Console(highlight=False, soft_wrap=True, markup=False)


def invite_person(name: str, role: str, robot: str, address: str) -> None:
    """Print a new link of a person with its QR code. Raises UserError for an invalid name, role or address."""
    if role not in ROLES:
        raise UserError(f"unknown role {role!r}{name_hint(role, ROLES)}")
    robot = _robot(robot)
    base = _base(address) if address else read_address(robot)
    invitations = Invitations(robot)
    replaced = any(person.name == name for person in invitations.people())
    token = invitations.invite(name, role)
    link = f"{base or _expected_address()}?token={token}"
    console.print(f"{name}: {role} at {robot}{'; the older link is not valid any more' if replaced else ''}")
    console.print(link)
    console.print(qr_code(link), style="bright_white on black")
    if not base:
        console.print(
            f"{robot} was not served to a network yet; start it with --lan. The link is for port {DEFAULT_PORT}: "
            f"if the launch prints another one, invite {name} again."
        )


def print_users(robot: str) -> None:
    """Print a line per invited person: name, role, time of the invitation and of the last command."""
    robot = _robot(robot)
    people = Invitations(robot).people()
    if not people:
        console.print(f"No one is invited to {robot}: chefbot page invite NAME --role waiter --robot {robot}")
    last = _last_seen(robot)
    width = max((cell_len(person.name) for person in people), default=0)
    for person in people:
        seen = last.get(person.name)
        used = f"last here {seen.astimezone():%Y-%m-%d %H:%M}" if seen else "not here yet"
        console.print(
            f"{set_cell_size(person.name, width)}  {person.role:8}  invited {local_time(person.invited)}, {used}"
        )


def revoke_person(name: str, robot: str) -> None:
    """Make the link of a person invalid. Raises UserError if no one of this name is invited."""
    robot = _robot(robot)
    Invitations(robot).revoke(name)
    console.print(f"The link of {name} to {robot} is not valid any more.")


def _robot(robot: str) -> str:
    """Return the robot's name: of a robot file, or of the only robot that was served from this computer."""
    if robot:
        return load_robot(robot).name
    if not (robots := served_robots()):
        raise UserError(
            "no robot of this computer was served to a network yet; name the robot or its file with --robot"
        )
    return recorded_robot("", robots, "web UIs", page_folder())


def _base(address: str) -> str:
    """Return an address that the user gave as a complete URL. Raises UserError if it is not a URL."""
    parts = urlsplit(address)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
        raise UserError(
            f"the address {address!r} must be like https://robot.example.org or http://192.168.1.7:8080"
        )
    return f"{parts.scheme}://{parts.netloc}{parts.path.rstrip('/')}/"


def _expected_address() -> str:
    return f"http://{own_address()}:{DEFAULT_PORT}/"


def _last_seen(robot: str) -> dict[str, datetime]:
    """Return the time of the newest entry of each name in the log of commands."""
    return {entry.name: entry.time for entry in read_entries(audit_path(robot)) if entry.name}
