"""`chefbot robot list`: a table of the built-in robots."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from chefbot.robot.geometry.layout import body_height
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import built_in_robots, load_robot

console = Console(highlight=False)


def list_robots() -> None:
    """Print size, mass, speed and payload of each built-in robot."""
    table = Table(
        "robot", "diameter, m", "height, m", "mass, kg", "speed, m/s", "payload, kg", "file", box=None
    )
    for name, path in built_in_robots().items():
        robot = load_robot(name)
        figures = (
            2.0 * robot.footprint_radius,
            body_height(robot),
            unloaded_mass(robot),
            robot.drive.max_speed,
            robot.body.payload,
        )
        table.add_row(name, *(f"{figure:.2f}" for figure in figures), str(path))
    console.print(table, soft_wrap=True)
