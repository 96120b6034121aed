"""Opening the owner's browser."""

from __future__ import annotations

import os
import sys
import webbrowser


def open_browser(url: str) -> bool:
    """Show `url` in a graphical browser; False where there is no screen: a text browser would take the terminal."""
    has_screen = sys.platform in ("darwin", "win32") or any(
        map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY"))
    )
    return has_screen and webbrowser.open(url)


def in_view(url: str, view: str) -> str:
    """A page's address with what it shows first, "2d" or "3d"; the fragment stays in the browser."""
    address = url.partition("#")[0]
    return f"{address}#3d" if view == "3d" else address
