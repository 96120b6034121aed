"""A simulated operator of the web UI for tests: `python web_ui_user.py PORT`; its standard input gives the commands.

see LAYER       waits for the layer; answers with a line of JSON: its value, or true for a bulky one
now LAYER       the newest value after half a second, null if there is none
do JSON         gives a command of the page
drive V W S     holds the stick so for S seconds, then lets go
pages           how many pages it has seen: it comes again when one has gone, as a browser does
"""

from __future__ import annotations

import sys
import threading
import time

import msgspec

from chefbot.errors import UserError
from chefbot.ui.commands import Drive, parse_command
from chefbot.ui.web_ui_client import ConnectionLostError, WebUiClient
from tests.support.waiting import PATIENCE


class Browser:
    """Looks all the time: the page drops those that do not."""

    def __init__(self, port: str) -> None:
        self.url = f"http://127.0.0.1:{port}"
        self.page = self.come()
        self.pages = 1
        threading.Thread(target=self.look, daemon=True).start()

    def come(self) -> WebUiClient:
        """As soon as a page is served."""
        until = time.monotonic() + PATIENCE
        while True:
            try:
                return WebUiClient(self.url)
            except UserError:
                if time.monotonic() > until:
                    raise
                time.sleep(0.2)

    def look(self) -> None:
        while True:
            try:
                self.page.receive()
            except ConnectionLostError:
                self.page = self.come()
                self.pages += 1

    def obey(self, verb: str, rest: str) -> object:
        """The answer."""
        if verb == "see":
            until = time.monotonic() + PATIENCE
            while self.page.latest.get(rest) is None and time.monotonic() < until:
                time.sleep(0.02)
            return plain(self.page.latest.get(rest))
        if verb == "now":
            time.sleep(0.5)
            return plain(self.page.latest.get(rest))
        if verb == "pages":
            return self.pages
        if verb == "do":
            self.page.send(parse_command(rest))
            return True
        v, w, seconds = map(float, rest.split())
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.page.send(Drive(v, w))
            time.sleep(0.1)
        self.page.send(Drive(0.0, 0.0))
        return True


def plain(value: object) -> object:
    return value if isinstance(value, (dict, list, str, float, int)) or value is None else True


def answer(value: object) -> None:
    sys.stdout.write(msgspec.json.encode(value).decode() + "\n")
    sys.stdout.flush()


def main(port: str) -> None:
    browser = Browser(port)
    answer("ready")
    for line in sys.stdin:
        verb, _, rest = line.strip().partition(" ")
        answer(browser.obey(verb, rest))


if __name__ == "__main__":
    main(sys.argv[1])
