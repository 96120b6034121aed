"""Prints the hash of the messages and the map of a recorded run, to compare runs.

    python -m tests.support.run_hash FOLDER...

Each folder is the output of `chefbot demo --out FOLDER`.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

from chefbot.runtime.recorded_log import LoggedMessage, read_log


def messages(folder: Path) -> list[LoggedMessage]:
    """Return the messages of run.mcap without the launches, which contain the name of the folder."""
    return [item for item in read_log(folder / "run.mcap").messages if item.topic != "chefbot/launch"]


def run_hash(folder: Path) -> str:
    """Return the SHA-256 of topic, publisher, time and bytes of every message and of the saved map."""
    digest = hashlib.sha256()
    for message in messages(folder):
        digest.update(f"{message.topic} {message.publisher} {message.time_ns} {len(message.data)} ".encode())
        digest.update(message.data)
    for name in ("map.yaml", "map.pgm"):
        digest.update((folder / name).read_bytes())
    return digest.hexdigest()


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        sys.stdout.write(f"{run_hash(Path(argument))} {argument}\n")
