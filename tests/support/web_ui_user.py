"""A client of the web UI, controlled by lines on standard input: `python web_ui_user.py PORT`.

see LAYER       wait for the layer and answer with its value as JSON, true for a large one
now LAYER       answer with the newest value after half a second, null if there is none
do JSON         send a command
drive V W S     hold the joystick for S seconds, then release it
pages           answer with the number of connections; it connects again after each loss, as a browser does
"""

from __future__ import annotations

import sys
import threading
import time

import msgspec

from chefbot.errors import UserError
from chefbot.ui.commands import Drive, parse_command
from chefbot.ui.remote.web_ui_client import ConnectionLostError, WebUiClient
from tests.support.waiting import PATIENCE


class Browser:
    """A connection that reads continuously, as the server disconnects clients that do not."""

    def __init__(self, port: str) -> None:
        self.url = f"http://127.0.0.1:{port}"
        self.page = self.connect()
        self.pages = 1
        threading.Thread(target=self.read, daemon=True).start()

    def connect(self) -> WebUiClient:
        """Connect as soon as the web UI is served."""
        until = time.monotonic() + PATIENCE
        while True:
            try:
                return WebUiClient(self.url)
            except UserError:
                if time.monotonic() > until:
                    raise
                time.sleep(0.2)

    def read(self) -> None:
        while True:
            try:
                self.page.receive()
            except ConnectionLostError:
                self.page = self.connect()
                self.pages += 1

    def execute(self, verb: str, rest: str) -> object:
        """Execute a line and return the answer."""
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
        answer(browser.execute(verb, rest))


if __name__ == "__main__":
    main(sys.argv[1])
