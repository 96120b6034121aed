"""The commands of `chefbot page`."""

from __future__ import annotations

from typing import Annotated

import typer

from chefbot.cli.command_group import new_group

page_app = new_group(
    "Who may use the web UI of a robot of this computer: links for persons, each with a role, that stay valid until "
    "they are revoked. A running robot follows at once.",
    short_help="Web UI: links for persons, valid until they are revoked.",
)
_NAME = typer.Argument(help="name of the person or device, as the log of commands shows it")
_ROLE = typer.Option(
    help="role: guest may look and stop; waiter may deliver; manager may drive anywhere; engineer may do everything"
)
_ROBOT = typer.Option(
    help="robot name or file; default: the only robot that was served to a network", show_default=False
)
_ADDRESS = typer.Option(
    help="address at which the person opens the web UI, as https://robot.example.org; default: the last one served",
    show_default=False,
)


@page_app.command("invite")
def invite(
    name: Annotated[str, _NAME],
    role: Annotated[str, _ROLE] = "waiter",
    robot: Annotated[str, _ROBOT] = "",
    address: Annotated[str, _ADDRESS] = "",
) -> None:
    """Print a link and its QR code for a person; it replaces an older link of the same name."""
    from chefbot.cli.page.users import invite_person

    invite_person(name, role, robot, address)


@page_app.command("users")
def users(robot: Annotated[str, _ROBOT] = "") -> None:
    """List who is invited, with role, date and last command."""
    from chefbot.cli.page.users import print_users

    print_users(robot)


@page_app.command("revoke")
def revoke(name: Annotated[str, _NAME], robot: Annotated[str, _ROBOT] = "") -> None:
    """Make the link of a person invalid; a browser with it keeps only STOP and is disconnected within 2 s."""
    from chefbot.cli.page.users import revoke_person

    revoke_person(name, robot)
