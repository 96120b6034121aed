"""The gate's own process: its configuration comes in, our answer and Zenoh's log go out; without input it ends."""

from __future__ import annotations

import sys

import zenoh

OPEN, FAILED = "chefbot: open", "chefbot: "
"""How the lines begin that are ours; all others are Zenoh's log."""


def main() -> None:
    """Also when the parent is killed, its end of the pipe closes, and this process goes: there are no orphans."""
    zenoh.try_init_log_from_env()
    try:
        session = zenoh.open(zenoh.Config.from_json5(sys.stdin.readline()))
    except zenoh.ZError as error:
        _say(FAILED + str(error).replace("\n", " "))
        return
    _say(OPEN)
    sys.stdin.read()
    session.close()


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
