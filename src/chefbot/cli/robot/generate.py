"""`chefbot robot generate`: a robot by a seed, as a robot file."""

from __future__ import annotations

import math
from pathlib import Path

from rich.console import Console

from chefbot.cli.given_numbers import given_numbers
from chefbot.design.generation.generate import generate_robot
from chefbot.errors import UserError
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import make_folder, write_atomic

TEMPLATE = "chefbot"
"""Robot that has what no number describes: materials, thickness of plates, computer."""
console = Console(highlight=False)


def run_generate(seed: int, numbers: list[str], out: Path) -> None:
    """Write the robot file and print what the robot is."""
    if out.suffix not in (".yaml", ".yml"):
        raise UserError(f"--out {out}: a robot file is YAML; give a name that ends in .yaml")
    given = given_numbers(numbers, "radius=0.2")
    generated = generate_robot(seed, given, load_robot(TEMPLATE), load_catalogue())
    options = "".join(f" --set {text}" for text in numbers)
    make_folder(out.parent)
    write_atomic(out, generated.text(f"chefbot robot generate --seed {seed}{options}").encode())
    console.print(f"{_summary(generated.robot)}\nrobot in {out}", soft_wrap=True)


def _summary(robot: Robot) -> str:
    lidar, camera = robot.sensors.lidar, robot.sensors.depth_camera
    sensors = [f"lidar of {math.degrees(lidar.field_of_view):.0f} deg"] if lidar is not None else []
    sensors += [f"depth camera of {math.degrees(camera.field_of_view):.0f} deg"] if camera is not None else []
    return (
        f"{robot.name}: radius {robot.circumscribed_radius:.3f} m, {unloaded_mass(robot):.2f} kg and"
        f" {robot.body.payload:.2f} kg of payload, {robot.drive.max_speed:.2f} m/s; {robot.motor.title};"
        f" {', '.join(sensors)}"
    )
