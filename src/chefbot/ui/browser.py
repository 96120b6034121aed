"""Opening the web UI in a browser."""

from __future__ import annotations

import os
import sys
import webbrowser


def has_screen() -> bool:
    """Return whether programs with windows can run here."""
    return sys.platform in ("darwin", "win32") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


def open_browser(url: str) -> bool:
    """Open `url` in a graphical browser; return False without a display, where a text browser would occupy
    the terminal."""
    return has_screen() and webbrowser.open(url)


def url_for_view(url: str, view: str) -> str:
    """Return the web UI's address that opens in `view`, "2d" or "3d"; the fragment is not sent to the server."""
    address = url.partition("#")[0]
    return f"{address}#3d" if view == "3d" else address
