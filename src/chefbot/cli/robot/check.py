"""`chefbot robot check`: the findings of a robot as a table, as JSON, and as a picture from above."""

from __future__ import annotations

import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from chefbot.cli.robot.units import amounts
from chefbot.design.checks.finding import Finding
from chefbot.design.checks.geometry_checks import check
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.load import load_robot

WIDTH = 110
"""Number of columns where the output is not a terminal."""
PLAIN = {"m^3": ("cm^3", 1e6), "": ("%", 100.0)}
"""Unit to the unit that is shown, and its number per unit, for units that `units` does not convert."""


def run_check(name_or_path: str, as_json: bool, out: Path | None) -> int:
    """Print the findings. Returns the exit code: 1 with errors, 0 with warnings only."""
    robot = load_robot(name_or_path)
    found = check(robot, load_catalogue())
    if as_json:
        console = Console(width=10**6, highlight=False, markup=False, soft_wrap=True)
        console.print(json.dumps({"robot": robot.name, "findings": [as_plain(f) for f in found]}, indent=2))
    else:
        _print(robot.name, found)
    if out is not None:
        from chefbot.cli.robot.check_picture import write_picture  # matplotlib takes a second to load

        write_picture(robot, out)
    return 1 if any(finding.severity == "error" for finding in found) else 0


def as_plain(finding: Finding) -> dict[str, object]:
    """Return a finding as plain data in SI units; an empty value is null."""
    return {**finding._asdict(), "value": finding.value or None}


def _print(name: str, found: list[Finding]) -> None:
    console = Console(highlight=False)
    console.width = min(console.width, WIDTH) if console.is_terminal else WIDTH
    if found:
        table = Table(show_lines=True)
        for column in ("", "what", "is", "should be", "change"):
            table.add_column(column, overflow="fold")
        for finding in found:
            table.add_row(*_row(finding))
        console.print(table)
    errors = sum(finding.severity == "error" for finding in found)
    colour = "red" if errors else "green"
    console.print(
        f"[{colour}]{name}: {_counted(errors, 'error')}, {_counted(len(found) - errors, 'warning')}[/]"
    )


def _counted(number: int, noun: str) -> str:
    return f"{number or 'no'} {noun}{'' if number == 1 else 's'}"


def _row(finding: Finding) -> tuple[str, ...]:
    colour = "red" if finding.severity == "error" else "yellow"
    unit, factor = PLAIN.get(finding.unit, (finding.unit, 1.0))
    have, bound = amounts(finding.have * factor, finding.bound * factor, unit)
    bound_name = "at least" if finding.at_least else "at most"
    change = f"{finding.key}: {finding.value}" if finding.value else finding.key
    return f"[{colour}]{finding.severity}[/]", finding.sentence, have, f"{bound_name} {bound}", change
