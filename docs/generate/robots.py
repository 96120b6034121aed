"""The page of the numbers of generated robots and their ranges."""

from __future__ import annotations

from pathlib import Path

from chefbot.design.generation.parameters import NUMBERS
from generate.buildings import number_table
from generate.rst import anchor, escape, heading, write


def write_robots(path: Path) -> None:
    """Write the page from the table of the numbers."""
    intro = "A seed draws each number from its range; `chefbot robot generate --set NAME=VALUE` fixes one."
    parts = [
        anchor("generated-robots"),
        heading("Numbers of robots"),
        escape(intro) + "\n",
        number_table(NUMBERS),
    ]
    write(path, parts)
