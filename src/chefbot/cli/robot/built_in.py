"""`chefbot robot list`: a table of the built-in robots."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from chefbot.robot.geometry.layout import body_height
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import ROBOT_FOLDER, built_in_robots, load_robot

console = Console(highlight=False, soft_wrap=True)


def list_robots() -> None:
    """Print size, mass, speed and payload of each built-in robot."""
    table = Table(box=None)
    for column in ("robot", "diameter, m", "height, m", "mass, kg", "speed, m/s", "payload, kg"):
        table.add_column(column, no_wrap=True)
    for name in built_in_robots():
        robot = load_robot(name)
        figures = (
            2.0 * robot.circumscribed_radius,
            body_height(robot),
            unloaded_mass(robot),
            robot.drive.max_speed,
            robot.body.payload,
        )
        table.add_row(name, *(f"{figure:.2f}" for figure in figures))
    console.print(table)
    console.print(f"\nTheir files are in {ROBOT_FOLDER}; a file of your own begins with `like: chefbot`.")
