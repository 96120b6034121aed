"""`chefbot drive history`: who gave which command at the web UI of a robot of this computer."""

from __future__ import annotations

import msgspec
from rich.console import Console

from chefbot.devices.stop_memory import check_state_folder
from chefbot.errors import UserError, name_hint
from chefbot.ui.access.audit_log import AuditEntry, audit_path, read_entries, recorded_robots

console = Console(highlight=False, soft_wrap=True, markup=False)


def print_history(robot: str, last: int) -> None:
    """Print the newest `last` entries; `robot`: its name in its file, empty if there is only one log.

    Raises UserError if there is no such log, or if there are several and none was named.
    """
    check_state_folder()
    robots = recorded_robots()
    if not robot and len(robots) == 1:
        robot = robots[0]
    if robot not in robots:
        folder = audit_path("").parent
        found = f"there are logs of {', '.join(robots)}" if robots else f"there is no log in {folder}"
        raise UserError(
            f"no log of robot {robot!r}{name_hint(robot, robots)}; {found}"
            if robot
            else f"{found}; name a robot"
        )
    for entry in list(read_entries(audit_path(robot)))[-last:]:
        console.print(_line(entry))


def _line(entry: AuditEntry) -> str:
    """Return an entry as one line: local time, who, what, and whether it was refused."""
    time = entry.time.astimezone().strftime("%Y-%m-%d %H:%M:%S")
    who = entry.name or entry.role
    address = f" at {entry.address}" if entry.address else ""
    details = f" {msgspec.json.encode(entry.details).decode()}" if entry.details else ""
    refused = f"; refused: {entry.refused}" if entry.refused else ""
    dropped = f" ({entry.dropped} more before it were not recorded)" if entry.dropped else ""
    return f"{time}  {who}{address}: {entry.action}{details}{refused}{dropped}"
