"""Hash of a recorded run: its messages and its map, so that two runs can be compared at a glance.

    python -m tests.support.run_hash FOLDER...

A folder is what `chefbot demo --out FOLDER` leaves.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

from chefbot.runtime.replay import LoggedMessage, read_log


def messages(folder: Path) -> list[LoggedMessage]:
    """Of run.mcap in their order, without the launches, which name the folder."""
    return [one for one in read_log(folder / "run.mcap").messages if one.topic != "chefbot/launch"]


def run_hash(folder: Path) -> str:
    """sha256 over topic, publisher, time and bytes of every message, then over the saved map."""
    digest = hashlib.sha256()
    for one in messages(folder):
        digest.update(f"{one.topic} {one.publisher} {one.time_ns} {len(one.data)} ".encode())
        digest.update(one.data)
    for name in ("map.yaml", "map.pgm"):
        digest.update((folder / name).read_bytes())
    return digest.hexdigest()


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        sys.stdout.write(f"{run_hash(Path(argument))} {argument}\n")
