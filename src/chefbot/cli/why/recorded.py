"""`chefbot why --history`: the causes that the web UI recorded in the history of a robot."""

from __future__ import annotations

from rich.console import Console

from chefbot.cli.drive.recorded_robot import existing_history, local_time
from chefbot.storage.cause_records import MAX_KEPT, RecordedCause, read_causes

console = Console(highlight=False, markup=False, soft_wrap=True)


def print_recorded(robot: str, last: int | None) -> None:
    """Print the newest `last` causes, all for None, the oldest of them first.

    `robot`: its name in its file, empty if there is only one history. Raises UserError if there is none, or if there
    are several and none was named.
    """
    causes = read_causes(existing_history(robot, "histories"), last or MAX_KEPT)
    for cause in reversed(causes):
        console.print(recorded_line(cause))
    if not causes:
        console.print("No causes yet.")


def recorded_line(cause: RecordedCause) -> str:
    """Return a cause as a line: local time, effect, duration, sentence."""
    lasted = f" {cause.duration:.1f} s" if cause.duration else ""
    simulated = " [simulated]" if cause.simulated else ""
    return f"{local_time(cause.began)}  {cause.effect + lasted:16}  {cause.sentence}{simulated}"
