"""What the launch prints about the access to its web UI."""

from __future__ import annotations

from chefbot.ui.access.visitors import GUEST, Visitor
from chefbot.ui.browser import url_for_view
from chefbot.ui.server import WebUiServer
from chefbot.ui.web_ui_params import WebUiParams

NOT_ENCRYPTED = (
    "Warning: not encrypted. Anyone who reads this network's traffic can read the token and drive the robot; "
    "set the page's parameter `certificate`, or use a network whose users you trust."
)


def announcement(server: WebUiServer, params: WebUiParams, url: str) -> str:
    """Return the lines that the launch prints: the address, and on a network those of further visitors."""
    lines = [f"Web UI: {url_for_view(url, params.view)}"]
    if params.port not in (0, server.port):
        lines.append(f"Port {params.port} is in use by another program.")
    if server.requires_token:
        visitors = [GUEST, *(Visitor(name, role) for name, role in params.visitors.items())]
        lines += [f"For {_display_name(visitor)}: {server.url_for(visitor)}" for visitor in visitors]
        lines += [] if params.certificate else [NOT_ENCRYPTED]
    return "\n  ".join(lines)


def _display_name(visitor: Visitor) -> str:
    return f"{visitor.name} ({visitor.role})" if visitor.name else "guests"
