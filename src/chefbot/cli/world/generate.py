"""`chefbot world generate`: a building by its kind and a seed, as a world file with its true map."""

from __future__ import annotations

import re
from pathlib import Path

from rich.console import Console

from chefbot.buildings.generate import generate
from chefbot.buildings.parameters import BuildingError, ranges_of
from chefbot.buildings.world_file import WorldSpec
from chefbot.buildings.world_text import world_text
from chefbot.cli.given_numbers import given_numbers
from chefbot.errors import UserError
from chefbot.maths.grid import FREE
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.sim.world.floor_plan import RESOLUTION, floor_plan, reachable
from chefbot.sim.world.world import World, parse_world
from chefbot.storage.atomic_files import make_folder, write_atomic
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places

FINE_RESOLUTION = 0.01
"""Size of the cells on which a path through narrow gaps is searched, if larger ones show none, m."""
console = Console(highlight=False)


def generate_world(kind: str, seed: int, size: str, numbers: list[str], robot_name: str, out: Path) -> None:
    """Write the world file and its map, NAME.map.yaml, and print what they hold."""
    if out.suffix not in (".yaml", ".yml"):
        raise UserError(f"--out {out}: a world file is YAML; give a name that ends in .yaml")
    robot = load_robot(robot_name)
    given = {**_size(kind, size), **given_numbers(numbers, "clutter=0.05")}
    spec = generate(kind, seed, given, robot.circumscribed_radius)
    text = world_text(spec, _comment(kind, seed, size, numbers, robot_name))
    world = parse_world(text.encode(), str(out))
    check_places(world, robot)
    make_folder(out.parent)
    write_atomic(out, text.encode())
    map_path = out.with_suffix(".map.yaml")
    sensor = robot.sensors.lidar or robot.sensors.depth_camera
    assert sensor is not None  # a robot file without both is refused
    save_map(map_path, floor_plan(world, sensor.mount.z))
    save_places(places_path(map_path), world.places)
    console.print(_summary(spec, world, out, map_path))


def check_places(world: World, robot: Robot) -> None:
    """Raise UserError if the robot does not reach a place of the world."""
    missing = _unreachable(world, robot, RESOLUTION) and _unreachable(world, robot, FINE_RESOLUTION)
    if missing:
        raise UserError(f"world {world.name}: the robot {robot.name} does not reach {', '.join(missing)}")


def _unreachable(world: World, robot: Robot, resolution: float) -> list[str]:
    floor = reachable(world, robot, resolution=resolution)
    return [name for name, pose in world.places.items() if floor.at(pose.x, pose.y) != FREE]


def _size(kind: str, text: str) -> dict[str, float]:
    """Return width and depth of '30x20'."""
    if not text:
        return {}
    if "width" not in ranges_of(kind):
        raise BuildingError(
            f"--size: a {kind} building has no width and depth; see `chefbot world kinds {kind}`"
        )
    match = re.fullmatch(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)", text)
    if match is None:
        raise UserError(f"--size {text:.40}: give metres along x and y, as 30x20")
    return {"width": float(match[1]), "depth": float(match[2])}


def _comment(kind: str, seed: int, size: str, numbers: list[str], robot: str) -> str:
    options = [f"--size {size}"] if size else []
    options += [f"--set {text}" for text in numbers]
    return " ".join([f"chefbot world generate {kind} --seed {seed}", *options, f"--robot {robot}"])


def _summary(spec: WorldSpec, world: World, out: Path, map_path: Path) -> str:
    x0, y0, x1, y1 = world.bounds
    tables = sum(name.startswith("table_") for name in spec.places)
    things = len(spec.tables) + len(spec.chairs) + len(spec.boxes) + len(spec.cylinders)
    return (
        f"{spec.name}: {x1 - x0:.1f} x {y1 - y0:.1f} m; walls: {len(spec.walls)}, doors: {len(spec.doors)}, "
        f"furniture: {things}, holes: {len(spec.holes)}, tables that can be reached: {tables}\n"
        f"world in {out}, true map in {map_path}"
    )
