"""The last ping of each page over its connections: what it sent before that ping has arrived."""

from __future__ import annotations

import secrets
from collections import OrderedDict

MAX_PAGES = 256
"""Number of pages that are remembered; the one that has been silent for longest is forgotten first."""
MAX_NAME = 64
"""Maximum length of a page's name."""


class ReceivedPings:
    """Lets a page that lost its connection find out whether its last commands arrived.

    A page names itself by a random text of its own and numbers its pings; `server` is another text after a restart.
    """

    def __init__(self) -> None:
        self.server = secrets.token_hex(4)
        self._last: OrderedDict[str, int] = OrderedDict()

    def note(self, page: str, number: int) -> None:
        """Remember the page's ping; a page without a name is not remembered."""
        if not page or len(page) > MAX_NAME:
            return
        self._last[page] = number
        self._last.move_to_end(page)
        if len(self._last) > MAX_PAGES:
            self._last.popitem(last=False)

    def last(self, page: str) -> int:
        """Return the number of the page's last ping; 0 without one."""
        return self._last.get(page, 0)
