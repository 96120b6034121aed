"""Access to the web UI from phones and other computers of the network, not only from this one."""

from __future__ import annotations

import socket

import msgspec

from chefbot.errors import UserError
from chefbot.runtime.launch import Launch, NodeEntry

ALL_ADDRESSES = "0.0.0.0"
"""All addresses of this computer (IPv4)."""
HOST_ARGUMENT = "page.host"
"""Argument `page.host:=ADDRESS` of every launch with a web UI; `--lan` means `page.host:=0.0.0.0`."""
PAGE = "chefbot.ui.web_ui:WebUiDevice"


def with_ui_address(launch: Launch, address: str) -> Launch:
    """Return the launch with its web UI served at `address`. Raises UserError if it has none."""
    pages = {name: _at(address, entry) for name, entry in launch.nodes.items() if entry.kind == PAGE}
    if not pages:
        why = (
            "headless:=true leaves it out"
            if launch.args["headless"]
            else "there is nothing to show to a phone"
        )
        raise UserError(f"launch {launch.name} has no web UI: {why}; leave out --lan and {HOST_ARGUMENT}:=")
    if not any(entry.host for entry in pages.values()):  # it may be an address of another machine
        _check_address(address)
    return msgspec.structs.replace(launch, nodes={**launch.nodes, **pages})


def _check_address(address: str) -> None:
    """Raise UserError unless this machine has the address: the web UI's own process would fail repeatedly."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        socket.create_server((address, 0), family=family).close()
    except OSError as error:
        raise UserError(f"The web UI cannot be served at {address}: {error.strerror or error}") from None


def _at(address: str, page: NodeEntry) -> NodeEntry:
    return msgspec.structs.replace(page, params={**page.params, "host": address})
