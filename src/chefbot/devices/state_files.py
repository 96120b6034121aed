"""Where the state of robots is kept on a computer: one folder, with files named after each robot."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.errors import UserError

VARIABLE = "CHEFBOT_STATE"
"""Environment variable with the folder of the state files."""


def state_folder() -> Path:
    """Return CHEFBOT_STATE, else a folder in the user's state (XDG_STATE_HOME, ~/.local/state)."""
    if folder := os.environ.get(VARIABLE):
        return Path(folder)
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "chefbot"


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
