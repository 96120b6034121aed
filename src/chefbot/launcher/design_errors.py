"""The errors of a robot file's design, printed before the robot is simulated or driven."""

from __future__ import annotations

from rich.console import Console

from chefbot.design.checks.geometry_checks import check
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.load import built_in_robots
from chefbot.robot.spec import Robot


def print_design_errors(console: Console, name_or_path: str, robot: Robot) -> None:
    """Print what `chefbot robot check` finds wrong with a robot file; built-in robots have no errors."""
    if name_or_path in built_in_robots():
        return
    errors = [f.sentence for f in check(robot, load_catalogue()) if f.severity == "error"]
    for sentence in errors:
        console.print(f"[red]Error[/] of robot {robot.name}: ", end="")
        console.print(sentence, markup=False, soft_wrap=True)
    if errors:
        console.print(
            f"`chefbot robot check {name_or_path}` shows the figures.", markup=False, soft_wrap=True
        )
