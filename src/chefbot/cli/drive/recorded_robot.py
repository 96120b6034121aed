"""Which robot of this computer is meant, of those that have a log of some kind."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from chefbot.devices.state_files import check_state_folder
from chefbot.errors import UserError, name_hint
from chefbot.ui.missions.history_device import history_path


def recorded_robot(robot: str, robots: Sequence[str], what: str, folder: Path) -> str:
    """Return the robot with this name, or the only one of `robots` if it is empty.

    `what`: the kind of log, in the plural. Raises UserError if there is none, or if there are several and none was
    named.
    """
    check_state_folder()
    if not robot and len(robots) == 1:
        return robots[0]
    if robot in robots:
        return robot
    found = f"there are {what} of {', '.join(robots)}" if robots else f"there are no {what} in {folder}"
    if robot:
        raise UserError(f"no {what} of robot {robot!r}{name_hint(robot, robots)}; {found}")
    raise UserError(f"{found}; name a robot" if robots else found)


def existing_history(robot: str, what: str) -> Path:
    """Return the history of a robot of this computer; see `recorded_robot`."""
    folder = history_path("").parent
    robots = sorted(path.stem for path in folder.glob("*.sqlite") if path.stem)
    return history_path(recorded_robot(robot, robots, what, folder))


def local_time(time: str) -> str:
    """Return a recorded time (UTC, ISO 8601) as the time of this computer's zone."""
    return datetime.fromisoformat(time).astimezone().strftime("%Y-%m-%d %H:%M:%S")
