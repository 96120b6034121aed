"""`chefbot drive history`: who gave which command at the web UI of a robot of this computer."""

from __future__ import annotations

from typing import Any

import msgspec
from rich.console import Console

from chefbot.cli.drive.recorded_robot import recorded_robot
from chefbot.ui.access.audit_log import AuditEntry, audit_path, read_entries, recorded_robots
from chefbot.ui.access.command_audit import CONNECTION_ACTIONS

console = Console(highlight=False, soft_wrap=True, markup=False)


def print_history(robot: str, last: int, connections: bool = False) -> None:
    """Print the newest `last` commands; `robot`: its name in its file, empty if there is only one log.

    `connections`: print also who connected and disconnected; each command of a terminal connects for itself.
    Raises UserError if there is no such log, or if there are several and none was named.
    """
    robot = recorded_robot(robot, recorded_robots(), "logs", audit_path("").parent)
    entries = read_entries(audit_path(robot))
    printed = [entry for entry in entries if connections or entry.action not in CONNECTION_ACTIONS]
    for entry in printed[-last:]:
        console.print(_line(entry))


def _line(entry: AuditEntry) -> str:
    """Return an entry as one line: local time, who, what, and whether it was refused."""
    time = entry.time.astimezone().strftime("%Y-%m-%d %H:%M:%S")
    who = entry.name or entry.role
    address = f" at {entry.address}" if entry.address else ""
    details = f" {msgspec.json.encode(_rounded(entry.details)).decode()}" if entry.details else ""
    refused = f"; refused: {entry.refused}" if entry.refused else ""
    dropped = f" ({entry.dropped} more before it were not recorded)" if entry.dropped else ""
    return f"{time}  {who}{address}: {entry.action}{details}{refused}{dropped}"


def _rounded(value: Any) -> Any:
    """Return what a command contained with its numbers to a millimetre or a thousandth of a radian."""
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(one) for one in value]
    return round(value, 3) if isinstance(value, float) else value
