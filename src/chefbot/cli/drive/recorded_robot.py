"""Which robot of this computer is meant, of those that have a log of some kind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from chefbot.devices.stop_memory import check_state_folder
from chefbot.errors import UserError, name_hint


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
