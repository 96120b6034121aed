"""Worlds by name, by world file, or extruded from any ROS map."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from chefbot.config import parse_yaml, read_bytes
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.free_floor import KITCHEN, MARGIN, FreeFloor
from chefbot.sim.world.map_world import world_from_map
from chefbot.sim.world.shapes import clearance
from chefbot.sim.world.world import ROBOT_SPACE, World, load_world
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_places, places_path

DEMO_MAP = "runs/demo/map.yaml"
"""Where `chefbot demo` leaves its map."""


MAP_KEYS = {"image", "mode", "negate", "occupied_thresh", "free_thresh"}
"""Of a map server's YAML file; no world has them."""


def load_any_world(name_or_path: str, robot: Robot, start: str = "") -> World:
    """A YAML file with a key that only maps have is a map, any other a world. start: as `parse_start` takes it.

    A map's places are those of NAME.places.yaml beside it, if there is one.
    """
    pose = parse_start(start)
    if is_map(name_or_path):
        path = Path(name_or_path)
        named = places_path(path)
        places = load_places(named) if named.exists() else {}
        return world_from_map(path.stem, load_map(path), robot.footprint_radius, pose, places=places)
    world = load_world(name_or_path)
    return world if pose is None else _started(world, pose, robot)


def is_map(name_or_path: str) -> bool:
    """Whether it names a ROS map rather than a world. UserError for a YAML file that is missing or broken."""
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        return False
    plain = parse_yaml(read_bytes(path, "world file"), f"world file {path}")
    return isinstance(plain, dict) and (
        not MAP_KEYS.isdisjoint(plain) or {"resolution", "origin"} <= plain.keys()
    )


def is_own_map(world: str, map_file: str) -> bool:
    """Whether localization uses the very map that the world is made of: then both have one frame."""
    return is_map(world) and (not map_file or Path(map_file).resolve() == Path(world).resolve())


def map_of(world: str, map_file: str) -> Path:
    """The map to localize on: the one given, else that of which the world is made, else the demo's."""
    if map_file or is_map(world):
        return Path(map_file or world)
    if not Path(DEMO_MAP).exists():
        raise UserError(
            f"there is no map yet: `chefbot demo` makes {DEMO_MAP}, or name one of your own, map_file:=MAP.yaml"
        )
    return Path(DEMO_MAP)


def parse_start(text: str) -> SE2 | None:
    """'[x, y, yaw]' in metres and radians in the world's frame; None for an empty text."""
    if not text:
        return None
    where = f"start:='{text:.60}'"
    plain = parse_yaml(text.encode(), where)
    if not isinstance(plain, list) or len(plain) != 3:
        raise UserError(f"{where} must be three numbers in brackets, start:='[x, y, yaw]' (metres, radians)")
    numbers = [value for value in plain if isinstance(value, (int, float)) and not isinstance(value, bool)]
    if len(numbers) != 3 or not all(math.isfinite(value) and abs(value) < 1e7 for value in numbers):
        raise UserError(f"{where} must be three finite numbers in metres and radians")
    if abs(numbers[2]) > 2.0 * math.pi:
        raise UserError(f"{where} turns by {numbers[2]:g} rad, more than once about: the yaw is in radians")
    return SE2(*map(float, numbers))


def with_places(world: World, robot: Robot, seed: int) -> World:
    """With a kitchen and tables drawn on its free floor by `seed`, where the world names none."""
    if KITCHEN in world.places and any(name.startswith("table_") for name in world.places):
        return world
    floor = _floor(world, robot)
    return dataclasses.replace(world, places={**floor.draw_places(world.start, seed), **world.places})


def _floor(world: World, robot: Robot) -> FreeFloor:
    """Where the robot can get to: on the known floor of a map, else between the solids of a world file."""
    if world.map is not None:
        return FreeFloor(world.map, robot.footprint_radius)
    return FreeFloor(reachable(world, robot, MARGIN), 0.0)


def _started(world: World, start: SE2, robot: Robot) -> World:
    """The world with another start. UserError where the robot would stand in something."""
    x0, y0, x1, y1 = world.bounds
    at = f"world {world.name}: the start ({start.x:.2f}, {start.y:.2f})"
    free = FreeFloor(reachable(world, robot, MARGIN), 0.0).nearest(start.x, start.y)
    instead = f"the nearest free pose is start:='[{free.x:.2f}, {free.y:.2f}, {start.yaw:.2f}]'"
    if not (x0 <= start.x <= x1 and y0 <= start.y <= y1):
        spans = f"x {x0:.2f} to {x1:.2f} and y {y0:.2f} to {y1:.2f} m"
        raise UserError(f"{at} lies outside, the world spans {spans}; {instead}")
    if clearance(world.shapes_at_rest(), start.x, start.y, *ROBOT_SPACE) < robot.footprint_radius:
        raise UserError(f"{at} lies in something or too near to it; {instead}")
    return dataclasses.replace(world, places={**world.places, "home": start}, start_note="as told")
