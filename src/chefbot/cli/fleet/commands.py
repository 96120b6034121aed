"""The commands of `chefbot fleet`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli.command_group import new_group

fleet_app = new_group(
    "Fleet: keys and certificates of robots and operators. On the machine that signs: init, sign, remove. On each "
    "robot and each operator's computer: request NAME, then accept; once a year: renew, then accept. Private keys "
    "never leave their machine.",
    short_help="Fleet: keys and certificates of its robots and operators.",
)
_FOLDER = typer.Option(help="folder of this machine's keys; default: CHEFBOT_KEYS, or ~/.config/chefbot/keys")
_ROLE = typer.Option(
    help="role of a new member: `robot` may use names in its namespace only, `operator` and `site` may command all"
)
_REPLACE = typer.Option(
    "--replace", help="sign for a name that already has a certificate; the old one is refused from then on"
)
_OUT = typer.Option(help="output file; default: NAME.card in the current folder")


@fleet_app.command("init")
def init(
    fleet: Annotated[str, typer.Argument(help="name of the fleet")] = "fleet",
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Create a fleet: this machine signs the certificates of its members, and may be the site's router."""
    from chefbot.cli.fleet.keys import create_fleet

    create_fleet(fleet, folder)


@fleet_app.command("request")
def request(
    name: Annotated[
        str, typer.Argument(help="name of the robot, also its ROS namespace, or of the operator")
    ],
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Create this machine's key and a request for its certificate; who signs it chooses its role."""
    from chefbot.cli.fleet.keys import request_membership

    request_membership(name, folder)


@fleet_app.command("sign")
def sign(
    request: Annotated[Path, typer.Argument(help="request file of a robot or an operator")],
    role: Annotated[str, _ROLE] = "",
    replace: Annotated[bool, _REPLACE] = False,
    out: Annotated[Path | None, _OUT] = None,
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Sign a request for a year; writes a card with the certificate, to be accepted on its machine."""
    from chefbot.cli.fleet.keys import sign_request

    sign_request(request, role, replace, out, folder)


@fleet_app.command("accept")
def accept(
    card: Annotated[Path, typer.Argument(help="card file from the machine that signs")],
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Accept a card: this machine's certificate, or the newest list of members."""
    from chefbot.cli.fleet.keys import accept_card

    accept_card(card, folder)


@fleet_app.command("renew")
def renew(folder: Annotated[Path | None, _FOLDER] = None) -> None:
    """Create a new key for this member and a request for its certificate; the old one stays in use meanwhile."""
    from chefbot.cli.fleet.keys import renew_membership

    renew_membership(folder)


@fleet_app.command("remove")
def remove(
    name: Annotated[str, typer.Argument(help="name of a member")],
    out: Annotated[Path | None, typer.Option(help="output file; default: fleet.card")] = None,
    folder: Annotated[Path | None, _FOLDER] = None,
) -> None:
    """Remove a member, for example after a loss or theft; all other machines must accept the new list."""
    from chefbot.cli.fleet.keys import remove_member

    remove_member(name, out, folder)


@fleet_app.command("show")
def show(folder: Annotated[Path | None, _FOLDER] = None) -> None:
    """Show this machine's identity, the members of the fleet and the expiry of the certificate."""
    from chefbot.cli.fleet.keys import show_identity

    show_identity(folder)
