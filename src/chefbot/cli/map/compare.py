"""`chefbot map compare`: the quality of a map compared with a reference map."""

from __future__ import annotations

import math
from pathlib import Path

from rich.console import Console
from rich.table import Table

from chefbot.mapping.compare import MapQuality, compare
from chefbot.storage.map_files import load_map, map_in

console = Console(highlight=False, soft_wrap=True)


def compare_maps(file: Path, truth: Path) -> None:
    """Print the quality of a map before and after rigid alignment. Raises UserError for an unreadable map."""
    result = compare(load_map(map_in(file)), load_map(map_in(truth)))
    table = Table("", "precision of walls", "recall of walls", "explored", box=None)
    table.add_row("as it is", *_ratios(result.as_is))
    table.add_row("aligned", *_ratios(result.aligned))
    console.print(table)
    x, y, yaw = result.alignment
    console.print(f"Offset of the map: x {x:+.3f} m, y {y:+.3f} m, yaw {math.degrees(yaw):+.2f} deg")


def _ratios(quality: MapQuality) -> tuple[str, ...]:
    return tuple(
        "none" if math.isnan(ratio) else f"{ratio:.1%}"
        for ratio in (quality.precision, quality.recall, quality.explored)
    )
