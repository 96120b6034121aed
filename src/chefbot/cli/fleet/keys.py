"""Implementation of the fleet commands: a keyring in a folder, and files to be carried between machines."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.fleet.keyring import Keyring, keys_folder
from chefbot.fleet.membership import Card, Role, read_card
from chefbot.storage.atomic_files import write_atomic

console = Console(highlight=False, soft_wrap=True, markup=False)


def create_fleet(name: str, folder: Path | None) -> None:
    """Create a fleet whose authority is this machine. Raises UserError if it belongs to one already."""
    ring = _keyring(folder)
    fleet = ring.create_fleet(name, datetime.now(UTC))
    console.print(
        f"Fleet {fleet.name} created. Keep a copy of {ring.folder} in a place where nobody else can read it."
    )
    console.print("Next, on a robot: chefbot fleet robot robot1")


def request_membership(name: str, role: Role, folder: Path | None) -> None:
    """Create this machine's key and a request for its certificate. Raises UserError for an invalid name."""
    request = _keyring(folder).request_membership(name, role)
    console.print(
        f"Copy {request} to the machine that signs, and run there: chefbot fleet sign {request.name}"
    )


def sign_request(request: Path, out: Path | None, folder: Path | None) -> None:
    """Sign a request and write the card. Raises UserError for an invalid request, or without the authority."""
    card, name = _keyring(folder).admit(request, datetime.now(UTC))
    role = card.members("the card").members[name]
    path = _write(card, out or Path(f"{name}.card"))
    console.print(
        f"{name} ({role}) is a member of the fleet now. Copy {path} to its machine, and run there: "
        f"chefbot fleet accept {path.name}"
    )
    console.print("The other members accept the same file, which contains the list of members.")


def accept_card(card: Path, folder: Path | None) -> None:
    """Accept a card from the authority. Raises UserError for an invalid or outdated one."""
    ring = _keyring(folder)
    fleet = ring.accept(read_card(card)[0])
    console.print(f"This machine is {ring.identity().name} of fleet {fleet.name}: {_members(fleet.members)}.")


def remove_member(name: str, out: Path | None, folder: Path | None) -> None:
    """Remove a member and write the new list. Raises UserError for an unknown name, or without the authority."""
    path = _write(_keyring(folder).remove(name), out or Path("fleet.card"))
    console.print(
        f"{name} is no longer a member on machines that have accepted {path}: chefbot fleet accept {path.name}"
    )


def show_identity(folder: Path | None) -> None:
    """Print identity, members and expiry of the certificate. Raises UserError if there is no certificate."""
    identity = _keyring(folder).identity()
    role = identity.role or "no longer a member"
    fleet = identity.fleet
    console.print(
        f"{identity.name}, {role} of fleet {fleet.name}, list {fleet.serial}: {_members(fleet.members)}"
    )
    console.print(f"certificate valid until {identity.expires:%Y-%m-%d}, in {identity.certificate.parent}")


def _keyring(folder: Path | None) -> Keyring:
    return Keyring(folder or keys_folder())


def _write(card: Card, path: Path) -> Path:
    write_atomic(path, msgspec.json.encode(card))
    return path


def _members(members: dict[str, Role]) -> str:
    return ", ".join(f"{name} ({role})" for name, role in sorted(members.items()))
