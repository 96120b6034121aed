"""An address as a QR code in text, for a terminal."""

from __future__ import annotations

from io import StringIO

import segno


def qr_code(address: str) -> str:
    """Return lines of half-block characters, which draw the light modules: show them light on dark."""
    text = StringIO()
    segno.make(address, error="l", micro=False, boost_error=False).terminal(out=text, border=2, compact=True)
    return text.getvalue().rstrip("\n")
