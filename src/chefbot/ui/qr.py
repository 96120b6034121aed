"""An address as a QR code of text, for a phone's camera before a terminal."""

from __future__ import annotations

from io import StringIO

import segno


def qr_code(address: str) -> str:
    """Lines of half blocks, the light modules drawn: show them light on dark."""
    text = StringIO()
    segno.make(address, error="l", micro=False, boost_error=False).terminal(out=text, border=2, compact=True)
    return text.getvalue().rstrip("\n")
