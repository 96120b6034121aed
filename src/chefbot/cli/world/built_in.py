"""`chefbot world list`: a table of the built-in worlds."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from chefbot.sim.world.world import built_in_worlds, load_world

console = Console(highlight=False)


def list_worlds() -> None:
    """Print size, places, doors and people of each built-in world."""
    table = Table("world", "size, m", "places", "doors", "people", box=None)
    for name in built_in_worlds():
        world = load_world(name)
        x0, y0, x1, y1 = world.bounds
        doors = ", ".join(door.name for door in world.doors)
        table.add_row(
            name, f"{x1 - x0:.1f} x {y1 - y0:.1f}", ", ".join(world.places), doors, str(world.people.count)
        )
    console.print(table)
