"""The gate's own process: a line of configuration comes in, `open` goes out; it ends when its input does."""

from __future__ import annotations

import sys

import zenoh

OPEN = "open"


def main() -> None:
    """Also when the parent is killed, its end of the pipe closes, and this process goes: there are no orphans."""
    zenoh.try_init_log_from_env()
    try:
        session = zenoh.open(zenoh.Config.from_json5(sys.stdin.readline()))
    except zenoh.ZError as error:
        _say(str(error).replace("\n", " "))
        return
    _say(OPEN)
    sys.stdin.read()
    session.close()


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
