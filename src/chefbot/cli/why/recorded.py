"""`chefbot why --history`: the causes that the web UI recorded in the history of a robot."""

from __future__ import annotations

from datetime import datetime

from rich.console import Console

from chefbot.cli.drive.recorded_robot import recorded_robot
from chefbot.storage.cause_records import MAX_KEPT, RecordedCause, read_causes
from chefbot.ui.missions.history_device import history_path

console = Console(highlight=False, markup=False, soft_wrap=True)


def print_recorded(robot: str, last: int | None) -> None:
    """Print the newest `last` causes, all for None, the oldest of them first.

    `robot`: its name in its file, empty if there is only one history. Raises UserError if there is none, or if there
    are several and none was named.
    """
    folder = history_path("").parent
    robots = sorted(path.stem for path in folder.glob("*.sqlite") if path.stem)
    causes = read_causes(history_path(recorded_robot(robot, robots, "histories", folder)), last or MAX_KEPT)
    for cause in reversed(causes):
        console.print(recorded_line(cause))
    if not causes:
        console.print("No causes yet.")


def recorded_line(cause: RecordedCause) -> str:
    """Return a cause as a line: local time, effect, duration, sentence."""
    began = datetime.fromisoformat(cause.began).astimezone().strftime("%Y-%m-%d %H:%M:%S")
    lasted = f" {cause.duration:.1f} s" if cause.duration else ""
    simulated = " [simulated]" if cause.simulated else ""
    return f"{began}  {cause.effect + lasted:16}  {cause.sentence}{simulated}"
