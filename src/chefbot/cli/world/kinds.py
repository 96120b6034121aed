"""`chefbot world kinds`: the kinds of buildings and the ranges of their numbers."""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Console
from rich.table import Table

from chefbot.buildings.parameters import COMMON, KINDS, ranges_of
from chefbot.maths.number_range import NumberRange

console = Console(highlight=False)


def list_kinds(kind: str) -> None:
    """Print the numbers of a kind, or of all. Raises BuildingError for an unknown kind."""
    if kind:
        console.print(_table(kind, ranges_of(kind)))
        return
    for name, ranges in KINDS.items():
        console.print(_table(name, ranges))
    console.print(_table("every kind", COMMON))


def _table(title: str, ranges: Mapping[str, NumberRange]) -> Table:
    table = Table(title, "from", "to", "unit", "meaning", box=None)
    for name, one in ranges.items():
        table.add_row(name, f"{one.low:g}", f"{one.high:g}", one.unit, one.meaning)
    return table
