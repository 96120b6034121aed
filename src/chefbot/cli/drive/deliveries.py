"""`chefbot drive deliveries`: the delivery rounds of a robot of this computer, as lines or as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from chefbot.cli.drive.recorded_robot import existing_history, local_time
from chefbot.place_names import display_name
from chefbot.plural import number_of
from chefbot.storage.atomic_files import write_into_folder
from chefbot.storage.delivery_history import RecordedRound, read_history

COLUMNS = (
    "began",
    "loaded",
    "ended",
    "ordered_by",
    "simulated",
    "place",
    "label",
    "outcome",
    "at",
    "round_outcome",
)
console = Console(highlight=False, soft_wrap=True, markup=False)


def print_deliveries(robot: str, last: int, csv_file: Path | None) -> None:
    """Print the newest `last` rounds, or write them as CSV with a line for each place (UTC, ISO 8601).

    `robot`: its name in its file, empty if there is only one history. Raises UserError if there is none, or if there
    are several and none was named.
    """
    rounds = read_history(existing_history(robot, "deliveries"), last)
    if csv_file is not None:
        write_into_folder(csv_file, csv_text(rounds).encode())
        console.print(f"{csv_file}: {number_of(len(rounds), 'round')}")
        return
    for one in rounds:
        console.print(round_line(one))
    if not rounds:
        console.print("No rounds yet.")


def round_line(one: RecordedRound) -> str:
    """Return a round as one line: local time, who ordered, each place with its outcome, how it ended."""
    who = f"{one.ordered_by}: " if one.ordered_by else ""
    places = ", ".join(
        f"{display_name(stop.place, stop.label)} ({_outcome(stop.outcome)})" for stop in one.stops
    )
    end = f"until {local_time(one.ended)[11:]}; {one.outcome}" if one.ended else "unfinished"
    simulated = " [simulated]" if one.simulated else ""
    return f"{local_time(one.began)}  {who}{places}; {end}{simulated}"


def _outcome(text: str) -> str:
    return text or "open"


def csv_text(rounds: Sequence[RecordedRound]) -> str:
    """Return the rounds as CSV (RFC 4180) with a header, one line for each place."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for one in rounds:
        for stop in one.stops:
            head = (one.began, one.loaded, one.ended, one.ordered_by, int(one.simulated))
            writer.writerow((*head, stop.place, stop.label, stop.outcome, stop.at, one.outcome))
    return text.getvalue()
