"""`chefbot keys`: who belongs to a fleet, and what each member may do."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

if TYPE_CHECKING:
    from chefbot.fleet.keyring import Keyring
    from chefbot.fleet.membership import Card, Role

console = Console(highlight=False, soft_wrap=True, markup=False)
keys_app = typer.Typer(
    no_args_is_help=True,
    help="The keys of a fleet. On the machine that signs: init, sign, remove. On each robot: robot NAME, then "
    "accept; on each person's computer: operator NAME, then accept. Private keys never leave their machine.",
)
_FOLDER = typer.Option(help="where this machine's keys are; default: CHEFBOT_KEYS, or ~/.config/chefbot/keys")
_OUT = typer.Option(help="file; default: NAME.card here")


@keys_app.command("init")
def init(
    fleet: Annotated[str, typer.Argument(help="its name")] = "fleet",
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Found a fleet: this machine signs its members from now on, and may be the site's router."""
    found = _keyring(folder).create_fleet(fleet, datetime.now(UTC))
    console.print(
        f"Fleet {found.name} founded. Keep a copy of {_keyring(folder).folder} where nobody else reads it."
    )
    console.print("Next, on a robot: chefbot keys robot robot1")


@keys_app.command("robot")
def robot(
    name: Annotated[str, typer.Argument(help="its name, which is its ROS namespace too")],
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """This machine is a robot: make its key and the request to be signed. It may use names below its own only."""
    _ask(_keyring(folder), name, "robot")


@keys_app.command("operator")
def operator(
    name: Annotated[str, typer.Argument(help="the person's name")],
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """This machine is a person's who may command all robots: make its key and the request to be signed."""
    _ask(_keyring(folder), name, "operator")


@keys_app.command("sign")
def sign(
    request: Annotated[Path, typer.Argument(help="a request that a robot or an operator made")],
    out: Annotated[Path | None, _OUT] = None,
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Admit who asks; writes the card to bring back there."""
    ring = _keyring(folder)
    card, name = ring.admit(request, datetime.now(UTC))
    role = card.members("the card").members[name]
    path = _write(card, out or Path(f"{name}.card"))
    console.print(
        f"{name} ({role}) belongs to the fleet now. Bring {path} there and say: chefbot keys accept {path.name}"
    )
    console.print("Other members learn of it by the same file.")


@keys_app.command("accept")
def accept(
    card: Annotated[Path, typer.Argument(help="from the machine that signs")],
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Take this machine's certificate, or the newest list of members, from a card."""
    from chefbot.fleet.membership import read_card

    ring = _keyring(folder)
    fleet = ring.accept(read_card(card)[0])
    console.print(f"This machine is {ring.identity().name} of fleet {fleet.name}: {_members(fleet.members)}.")


@keys_app.command("remove")
def remove(
    name: Annotated[str, typer.Argument(help="of a member")],
    out: Annotated[Path | None, _OUT] = None,
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Take a member off the list: lost, stolen, sold. Every other machine has to accept the new list."""
    path = _write(_keyring(folder).remove(name), out or Path("fleet.card"))
    console.print(f"{name} is no member any more where {path} was accepted: chefbot keys accept {path.name}")


@keys_app.command("show")
def show(folder: Annotated[Path | None, _FOLDER] = None) -> None:
    """Who this machine is, who else there is, how long the certificate is good."""
    me = _keyring(folder).identity()
    role = me.role or "no member any more"
    console.print(
        f"{me.name}, {role} of fleet {me.fleet.name}, list {me.fleet.serial}: {_members(me.fleet.members)}"
    )
    console.print(f"certificate good until {me.expires:%Y-%m-%d}, in {me.certificate.parent}")


def _keyring(folder: Path | None) -> Keyring:
    from chefbot.fleet.keyring import Keyring, keys_folder

    return Keyring(folder or keys_folder())


def _ask(ring: Keyring, name: str, role: Role) -> None:
    request = ring.request_membership(name, role)
    console.print(
        f"Bring {request} to the machine that signs and say there: chefbot keys sign {request.name}"
    )


def _write(card: Card, path: Path) -> Path:
    import msgspec

    from chefbot.storage.atomic_files import write_atomic

    write_atomic(path, msgspec.json.encode(card))
    return path


def _members(members: dict[str, Role]) -> str:
    return ", ".join(f"{name} ({role})" for name, role in sorted(members.items()))
