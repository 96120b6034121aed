"""`chefbot drive history`: who gave which command at the web UI of a robot of this computer."""

from __future__ import annotations

import msgspec
from rich.console import Console

from chefbot.cli.drive.recorded_robot import recorded_robot
from chefbot.ui.access.audit_log import AuditEntry, audit_path, read_entries, recorded_robots

console = Console(highlight=False, soft_wrap=True, markup=False)


def print_history(robot: str, last: int) -> None:
    """Print the newest `last` entries; `robot`: its name in its file, empty if there is only one log.

    Raises UserError if there is no such log, or if there are several and none was named.
    """
    robot = recorded_robot(robot, recorded_robots(), "logs", audit_path("").parent)
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
