"""Implementation of the fleet commands: a keyring in a folder, and files to be carried between machines."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.fleet.identity import RENEWAL_NOTICE
from chefbot.fleet.keyring import Keyring, keys_folder, request_fingerprint
from chefbot.fleet.membership import Card, Fleet, Member, check_role, read_card
from chefbot.storage.atomic_files import write_atomic

console = Console(highlight=False, soft_wrap=True, markup=False)


def create_fleet(name: str, folder: Path | None) -> None:
    """Create a fleet whose authority is this machine. Raises UserError if it belongs to one already."""
    ring = _keyring(folder)
    fleet = ring.create_fleet(name, datetime.now(UTC))
    console.print(
        f"Fleet {fleet.name} created. Keep a copy of {ring.folder} in a place where no one else can read it."
    )
    console.print("Next, on a robot: chefbot fleet request robot1")


def request_membership(name: str, folder: Path | None) -> None:
    """Create this machine's key and a request for its certificate. Raises UserError for an invalid name."""
    _print_request(_keyring(folder).request_membership(name), "--role robot")
    console.print("For the computer of a person who commands all robots: --role operator.")


def renew_membership(folder: Path | None) -> None:
    """Create a new key and request for this member. Raises UserError if this machine is not a member.

    On the authority's machine the new certificate is signed and put into use at once.
    """
    ring = _keyring(folder)
    request = ring.renew(datetime.now(UTC))
    if request is not None:
        _print_request(request, "--replace")
        return
    path = _write(ring.card(), Path("fleet.card"))
    console.print(
        f"The certificate of {ring.identity().name} is valid until {ring.identity().expires:%Y-%m-%d}."
    )
    console.print(f"All other machines accept the new list in {path}: chefbot fleet accept {path.name}")


def _print_request(request: Path, options: str) -> None:
    console.print(
        f"Copy {request} to the machine that signs, and run there: chefbot fleet sign {request.name} {options}"
    )
    console.print(
        f"Key fingerprint: {request_fingerprint(request)}. Check that `chefbot fleet sign` prints the same one."
    )


def sign_request(request: Path, role: str, replace: bool, out: Path | None, folder: Path | None) -> None:
    """Sign a request and write the card.

    Raises UserError for an invalid request or role, for a name that has a certificate unless `replace`, and
    without the authority.
    """
    chosen = check_role(role) if role else None
    ring = _keyring(folder)
    card, name = ring.admit(request, datetime.now(UTC), chosen, replace)
    member = card.members("the card").members[name]
    path = _write(card, out or Path(f"{name}.card"))
    _print_membership(name, member, path)
    console.print("The other members accept the same file, which contains the list of members.")
    console.print(
        f"The authority's key is {ring.authority_fingerprint()}; each machine shows it when it accepts."
    )
    if replace:
        console.print(f"Machines that have accepted it refuse the former certificate of {name}.")


def _print_membership(name: str, member: Member, card: Path) -> None:
    console.print(
        f"{name} ({member.role}) is a member of the fleet until {member.expires:%Y-%m-%d}, with key {member.key}. "
        f"Copy {card} to its machine, and run there: chefbot fleet accept {card.name}"
    )


def accept_card(card: Path, folder: Path | None) -> None:
    """Accept a card from the authority. Raises UserError for an invalid or outdated one."""
    ring = _keyring(folder)
    fleet = ring.accept(read_card(card)[0])
    me = ring.identity()
    console.print(f"This machine is {me.name} of fleet {fleet.name}: {_members(fleet)}.")
    console.print(f"The authority's key is {ring.authority_fingerprint()}.")
    _print_warning(ring)


def remove_member(name: str, out: Path | None, folder: Path | None) -> None:
    """Remove a member and write the new list. Raises UserError for an unknown name, or without the authority."""
    path = _write(_keyring(folder).remove(name), out or Path("fleet.card"))
    console.print(
        f"{name} is no longer a member on machines that have accepted {path}: chefbot fleet accept {path.name}"
    )


def show_identity(folder: Path | None) -> None:
    """Print identity, members and expiry of the certificate. Raises UserError if there is no certificate."""
    ring = _keyring(folder)
    me = ring.identity()
    console.print(
        f"{me.name}, {me.role or 'no longer a member'} of fleet {me.fleet.name}, list {me.fleet.number}: "
        f"{_members(me.fleet)}"
    )
    console.print(
        f"certificate valid until {me.expires:%Y-%m-%d}, in {me.certificate.parent}; the authority's key is "
        f"{ring.authority_fingerprint()}"
    )
    for name, member in sorted(me.fleet.members.items()):
        if member.expires - datetime.now(UTC) <= RENEWAL_NOTICE:
            console.print(f"! {name}'s certificate is valid until {member.expires:%Y-%m-%d} only")
    _print_warning(ring)


def _print_warning(ring: Keyring) -> None:
    """Print what prevents the use of this machine's certificate, or will soon."""
    if warning := ring.warning(datetime.now(UTC)):
        console.print(f"! {warning}")


def _keyring(folder: Path | None) -> Keyring:
    return Keyring(folder or keys_folder())


def _write(card: Card, path: Path) -> Path:
    write_atomic(path, msgspec.json.encode(card))
    return path


def _members(fleet: Fleet) -> str:
    return ", ".join(f"{name} ({member.role})" for name, member in sorted(fleet.members.items()))
