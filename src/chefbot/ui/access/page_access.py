"""What the launch prints about the access to its web UI."""

from __future__ import annotations

from chefbot.storage.atomic_files import StorageError
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.visitors import GUEST
from chefbot.ui.browser import url_for_view
from chefbot.ui.server import WebUiServer
from chefbot.ui.web_ui_params import WebUiParams

NOT_ENCRYPTED = (
    "Warning: not encrypted. Anyone who reads this network's traffic can read the token and drive the robot; "
    "set the web UI's parameter `certificate`, or use a network whose users you trust."
)


def announcement(server: WebUiServer, params: WebUiParams, url: str, invitations: Invitations) -> str:
    """Return the lines that the launch prints: the address, and on a network that of guests and how to invite."""
    lines = [f"Web UI: {url_for_view(url, params.view)}"]
    if params.port not in (0, server.port):
        lines.append(f"Port {params.port} is in use by another program.")
    if server.requires_token:
        lines += [f"For guests: {server.url_for(GUEST)}", _invited(invitations)]
        lines += [] if params.certificate else [NOT_ENCRYPTED]
    return "\n  ".join(lines)


def _invited(invitations: Invitations) -> str:
    """Return whose links stay valid over launches, or why nobody's do."""
    how = f"chefbot page invite NAME --role waiter --robot {invitations.robot}"
    try:
        names = ", ".join(f"{person.name} ({person.role})" for person in invitations.people())
    except StorageError as error:
        return f"Warning: {error}"
    return f"Invited: {names}" if names else f"Links for persons that outlast this launch: {how}"
