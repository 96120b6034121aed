"""Where the state of robots is kept on a computer: one folder, with files named after each robot."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta

from chefbot.errors import UserError
from chefbot.storage.atomic_files import make_folder, write_atomic

MAX_SIZE = 10_000
"""Size of a file above which it is not a state, bytes."""
S = TypeVar("S", bound=msgspec.Struct)
VARIABLE = "CHEFBOT_STATE"
"""Environment variable with the folder of the state files."""


def state_folder() -> Path:
    """Return CHEFBOT_STATE, else a folder in the user's state (XDG_STATE_HOME, ~/.local/state)."""
    if folder := os.environ.get(VARIABLE):
        return Path(folder)
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "chefbot"


def maps_folder() -> Path:
    """Return the folder of the maps that were saved in the web UI."""
    return state_folder() / "maps"


def check_state_folder() -> None:
    """Raise UserError if there is something else in the place of the folder."""
    folder = state_folder()
    if folder.exists() and not folder.is_dir():
        raise UserError(f"{folder}, where the state of robots is kept ({VARIABLE}), is not a folder")


class StateFileParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of a device that keeps state of its robot."""

    namespace: Annotated[str, Meta(description="the robot's; empty where there is none")] = ""

    def file_name(self, robot: str) -> str:
        """Return the name, without suffix, of the state files of a robot by its name in the robot file."""
        return f"{self.namespace}/{robot}".strip("/").replace("/", "_")


def read_state(path: Path, kind: type[S]) -> S | None:
    """Read a state; None if there is none. Raises OSError, ValueError and MsgspecError if it cannot be read."""
    if not path.exists():
        return None
    if path.stat().st_size > MAX_SIZE:
        raise ValueError("the file is too large for a state")
    return msgspec.json.decode(path.read_bytes(), type=kind)


def store_state(path: Path, state: msgspec.Struct) -> None:
    """Write a state as a whole or not at all. Raises StorageError."""
    make_folder(path.parent)
    write_atomic(path, msgspec.json.format(msgspec.json.encode(state), indent=2) + b"\n")
