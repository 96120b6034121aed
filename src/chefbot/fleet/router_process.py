"""Process of the secure router: configuration in, status and Zenoh's log out; exits at the end of input."""

from __future__ import annotations

import sys

import zenoh

OPEN, FAILED = "chefbot: open", "chefbot: "
"""Prefixes of status lines; all other lines are Zenoh's log."""


def main() -> None:
    """Run the router until the input ends.

    The input also ends when the parent is killed, so no orphan remains.
    """
    zenoh.try_init_log_from_env()
    try:
        session = zenoh.open(zenoh.Config.from_json5(sys.stdin.readline()))
    except zenoh.ZError as error:
        _write_line(FAILED + str(error).replace("\n", " "))
        return
    _write_line(OPEN)
    sys.stdin.read()
    session.close()


def _write_line(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
