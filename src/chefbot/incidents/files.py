"""Files of incidents: an MCAP log of a minute, with what, when and by whom it was saved."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import msgspec

from chefbot.robot.spec import Robot
from chefbot.runtime.loop import Publication
from chefbot.runtime.recorder import Recorder
from chefbot.storage.atomic_files import (
    StorageError,
    make_folder,
    os_errors_as_storage_errors,
    remove,
    rename_existing,
)
from chefbot.storage.mcap_reading import READ_ERRORS, mcap_reader

INCIDENT_METADATA = "incident"
"""Name of the metadata record that makes a log an incident."""
NAME = re.compile(r"^[A-Za-z0-9_.-]{1,100}\.mcap$")
MAX_AUTOMATIC = 20
"""Number of incidents that were saved without an order and are kept; older ones are removed."""


class Incident(msgspec.Struct, frozen=True, kw_only=True):
    """What is known of an incident beside its messages.

    time: when it was saved, UTC, as 2026-01-31T09:05:00Z. by: who saved it, empty for the robot itself.
    """

    robot: str
    time: str
    sentence: str
    by: str = ""

    @property
    def file_name(self) -> str:
        """Name of its file; those that the robot saved end in `-auto.mcap`."""
        robot = re.sub(r"[^A-Za-z0-9_-]", "_", self.robot)[:40]
        stamp = re.sub(r"[^0-9TZ]", "", self.time)
        return f"{robot}-{stamp}{'' if self.by else '-auto'}.mcap"


def printable(text: str) -> str:
    """Return a text without characters that would control a terminal or the direction of writing."""
    return "".join(character for character in text if character.isprintable())


class SavedIncident(msgspec.Struct, frozen=True, kw_only=True):
    """An incident with the name and the size (bytes) of its file."""

    name: str
    size: int
    incident: Incident


def save_incident(
    folder: Path,
    incident: Incident,
    content: Iterable[Publication],
    robot: Robot,
    seed: int,
    *,
    keep_part: bool = False,
) -> Path:
    """Write an incident to a folder, whole or not at all; StorageError if that fails. Returns its path.

    keep_part: whether what was written before a disk became full is kept, though StorageError is raised.
    """
    make_folder(folder)
    path = folder / incident.file_name
    temporary = path.with_suffix(".part")
    failures: list[str] = []
    notes = {INCIDENT_METADATA: {key: str(value) for key, value in msgspec.to_builtins(incident).items()}}
    try:
        with closing(
            Recorder(temporary, robot, seed, on_end=failures.append, images=True, notes=notes)
        ) as recorder:
            temporary.chmod(0o600)  # pictures of people
            for publication in content:
                recorder(publication)
        if failures and not keep_part:
            raise StorageError(failures[0])
        rename_existing(path)  # of the same second
        with os_errors_as_storage_errors(path):
            temporary.replace(path)
        if failures:
            raise StorageError(f"{failures[0]}; what was written before is kept")
    except BaseException:
        remove([temporary])
        raise
    return path


def remove_old(folder: Path, robot: str) -> None:
    """Remove the oldest of the incidents of a robot that it saved itself, beyond MAX_AUTOMATIC."""
    automatic = [saved for saved in saved_incidents(folder, robot) if not saved.incident.by]
    remove([folder / saved.name for saved in automatic[MAX_AUTOMATIC:]])


def saved_incidents(folder: Path, robot: str, newest: int | None = None) -> list[SavedIncident]:
    """Return the incidents of a robot in a folder, the newest first; files that are none or damaged are left out."""
    noted = ((path, read_incident(path)) for path in folder.glob("*.mcap") if NAME.match(path.name))
    found = [
        SavedIncident(name=path.name, size=path.stat().st_size, incident=incident)
        for path, incident in noted
        if incident is not None and incident.robot == robot
    ]
    return sorted(found, key=lambda saved: (saved.incident.time, saved.name), reverse=True)[:newest]


def read_incident(path: Path) -> Incident | None:
    """Return what a file of an incident notes about it; None if it is none or cannot be read."""
    try:
        with path.open("rb") as file:
            notes = {record.name: record.metadata for record in mcap_reader(file).iter_metadata()}
    except (OSError, *READ_ERRORS):
        return None
    return _incident(notes.get(INCIDENT_METADATA, {}))


def _incident(notes: dict[str, Any]) -> Incident | None:
    try:
        return msgspec.convert({key: printable(value) for key, value in notes.items()}, Incident)
    except msgspec.ValidationError:
        return None
