"""The page of the numbers of generated buildings and their ranges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from chefbot.buildings.parameters import COMMON, KINDS
from chefbot.maths.number_range import NumberRange
from generate.rst import anchor, code, escape, heading, table, write


def write_buildings(path: Path) -> None:
    """Write the page from the tables of the kinds."""
    intro = (
        "A seed draws each number from its range; `chefbot world generate KIND --set NAME=VALUE` fixes one."
    )
    parts = [anchor("buildings"), heading("Numbers of buildings"), escape(intro) + "\n"]
    for title, ranges in (("Every kind", COMMON), *KINDS.items()):
        parts += [heading(title, "-"), number_table(ranges)]
    write(path, parts)


def number_table(ranges: Mapping[str, NumberRange]) -> str:
    """Return the table of numbers with their ranges, units and meanings."""
    return table(("number", "from", "to", "unit", "meaning"), _rows(ranges))


def _rows(ranges: Mapping[str, NumberRange]) -> Iterator[tuple[str, ...]]:
    for name, one in ranges.items():
        yield code(name), f"{one.low:g}", f"{one.high:g}", escape(one.unit), escape(one.meaning)
