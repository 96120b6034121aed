"""A person at the operator's page, for tests: `python page_user.py PORT`, told by its standard input what to do.

see LAYER       waits for the layer; answers with a line of JSON: its value, or true for a bulky one
now LAYER       the newest value after half a second, null if there is none
do JSON         gives a command of the page
drive V W S     holds the stick so for S seconds, then lets go
"""

from __future__ import annotations

import sys
import time

import msgspec

from chefbot.errors import UserError
from chefbot.ui.commands import Drive, parse_command
from chefbot.ui.remote import RemotePage

PATIENCE = 60.0


def main(port: str) -> None:
    until = time.monotonic() + PATIENCE
    while True:
        try:
            page = RemotePage(f"http://127.0.0.1:{port}")
            break
        except UserError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)
    answer("ready")
    for line in sys.stdin:
        verb, _, rest = line.strip().partition(" ")
        if verb == "see":
            answer(plain(page.wait_for(rest, PATIENCE)))
        elif verb == "now":
            listen(page, 0.5)
            answer(plain(page.latest.get(rest)))
        elif verb == "do":
            page.send(parse_command(rest))
            answer(True)
        elif verb == "drive":
            v, w, seconds = map(float, rest.split())
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                page.send(Drive(v, w))
                listen(page, 0.1)
            page.send(Drive(0.0, 0.0))
            answer(True)
    page.close()


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
