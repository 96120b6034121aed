"""A person at the operator's page, for tests: `python page_user.py PORT`, told by its standard input what to do.

see LAYER       waits for the layer; answers with a line of JSON: its value, or true for a bulky one
now LAYER       the newest value after half a second, null if there is none
do JSON         gives a command of the page
drive V W S     holds the stick so for S seconds, then lets go

Where the page has gone, it waits for the next one and answers null.
"""

from __future__ import annotations

import sys
import time

import msgspec

from chefbot.errors import UserError
from chefbot.ui.commands import Drive, parse_command
from chefbot.ui.remote import PageGoneError, RemotePage

PATIENCE = 60.0


def main(port: str) -> None:
    page = come(port)
    answer("ready")
    for line in sys.stdin:
        verb, _, rest = line.strip().partition(" ")
        try:
            answer(obey(page, verb, rest))
        except PageGoneError:  # a browser comes again, too
            page.close()
            page = come(port)
            answer(None)
    page.close()


def come(port: str) -> RemotePage:
    """As soon as a page is served."""
    until = time.monotonic() + PATIENCE
    while True:
        try:
            return RemotePage(f"http://127.0.0.1:{port}")
        except UserError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)


def obey(page: RemotePage, verb: str, rest: str) -> object:
    """The answer."""
    if verb == "see":
        return plain(page.wait_for(rest, PATIENCE))
    if verb == "now":
        listen(page, 0.5)
        return plain(page.latest.get(rest))
    if verb == "do":
        page.send(parse_command(rest))
        return True
    v, w, seconds = map(float, rest.split())
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        page.send(Drive(v, w))
        listen(page, 0.1)
    page.send(Drive(0.0, 0.0))
    return True


def listen(page: RemotePage, seconds: float) -> None:
    """Take in what comes."""
    end = time.monotonic() + seconds
    while (rest := end - time.monotonic()) > 0:
        page.receive(rest)


def plain(value: object) -> object:
    return value if isinstance(value, (dict, list, str, float, int)) or value is None else True


def answer(value: object) -> None:
    sys.stdout.write(msgspec.json.encode(value).decode() + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1])
