"""Loading of worlds by name, from a world file, or extruded from a ROS map."""

from __future__ import annotations

import dataclasses
import math
from functools import lru_cache
from pathlib import Path
from typing import Annotated, cast, get_args

from msgspec import Meta

from chefbot.config import parse_yaml, read_bytes
from chefbot.errors import UserError, name_hint
from chefbot.file_kinds import MAP, is_kind
from chefbot.mapping.map_format import decode_map
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.free_floor import KITCHEN, MARGIN, FreeFloor
from chefbot.sim.world.map_world import UnknownCells, world_from_map
from chefbot.sim.world.shapes import clearance
from chefbot.sim.world.world import ROBOT_SPACE, World, load_world
from chefbot.storage.map_files import MapFiles, read_map_files
from chefbot.storage.places import load_places, places_path

WorldName = Annotated[str, Meta(min_length=1, description="a world's name, a world file, or a ROS map.yaml")]
StartPose = Annotated[str, Meta(description="start pose of the robot, as in the simulator's parameters")]
UnknownParam = Annotated[
    UnknownCells,
    Meta(description="unknown cells of a map: wall, free, or auto, walls if large or at the map's edge"),
]
PlacesSeed = Annotated[int, Meta(ge=0, description="random seed of the places drawn if the world names none")]
DEMO_MAP = "runs/demo/map.yaml"
"""Path at which `chefbot demo` saves its map."""


def load_any_world(name_or_path: str, robot: Robot, start: str = "", unknown: UnknownCells = "auto") -> World:
    """Load a world by name, from a world file or from a ROS map; a YAML file with map keys is a map.

    start: start pose as text, see `parse_start_pose`. unknown: what unknown cells of a map are. A map's places are
    read from NAME.places.yaml beside it, if it exists.
    """
    pose = parse_start_pose(start)
    if is_map(name_or_path):
        path = Path(name_or_path)
        places_file = places_path(path)
        places = load_places(places_file) if places_file.exists() else {}
        files = read_map_files(path)
        return _map_world(str(path), files, robot.circumscribed_radius, pose, tuple(places.items()), unknown)
    if unknown != "auto":
        raise UserError(
            f"world {name_or_path} has no unknown cells, only a map has; leave out unknown:={unknown}"
        )
    world = load_world(name_or_path)
    return world if pose is None else _with_start(world, pose, robot)


@lru_cache(maxsize=2)  # demo, simulator, places and initial pose each load the same world
def _map_world(
    name: str,
    files: MapFiles,
    radius: float,
    start: SE2 | None,
    places: tuple[tuple[str, SE2], ...],
    unknown: UnknownCells,
) -> World:
    return world_from_map(name, decode_map(*files), radius, start, dict(places), unknown)


def is_map(name_or_path: str) -> bool:
    """Return whether the name is that of a ROS map. Raises UserError for a missing or broken YAML file."""
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        return False
    return is_kind(parse_yaml(read_bytes(path, "world file"), f"world file {path}"), MAP)


def shares_map_frame(world: str, map_file: str) -> bool:
    """Return whether localization uses the map that the world is made of, so that both share one frame."""
    return is_map(world) and (not map_file or Path(map_file).resolve() == Path(world).resolve())


def map_to_localize_on(world: str, map_file: str) -> Path:
    """Return the map to localize on: the given one, else the one the world is made of, else the demo's."""
    if map_file or is_map(world):
        return Path(map_file or world)
    if not Path(DEMO_MAP).exists():
        raise UserError(
            f"there is no map yet: `chefbot demo` makes {DEMO_MAP}, or name one of your own, map_file:=MAP.yaml"
        )
    return Path(DEMO_MAP)


def parse_start_pose(text: str) -> SE2 | None:
    """Parse '[x, y, yaw]' in metres and radians in the world's frame; None for an empty text."""
    if not text:
        return None
    where = f"start:='{text:.60}'"
    data = parse_yaml(text.encode(), where)
    if not isinstance(data, list) or len(data) != 3:
        raise UserError(f"{where} must be three numbers in brackets, start:='[x, y, yaw]' (metres, radians)")
    # YAML takes 1e0 for a text, as it has no dot
    numbers = [_number_of(value) for value in data]
    if not all(math.isfinite(value) and abs(value) < 1e7 for value in numbers):
        raise UserError(f"{where} must be three finite numbers in metres and radians")
    if abs(numbers[2]) > 2.0 * math.pi:
        raise UserError(f"{where} turns by {numbers[2]:g} rad, more than once about: the yaw is in radians")
    return SE2(*numbers)


def _number_of(value: object) -> float:
    """Return a number of YAML, NaN for anything else."""
    try:
        return (
            float(value) if isinstance(value, (int, float, str)) and not isinstance(value, bool) else math.nan
        )
    except (ValueError, OverflowError):
        return math.nan


def unknown_cells(text: str) -> UnknownCells:
    """Return what unknown cells of a map are, by its name on the command line."""
    for known in get_args(UnknownCells):
        if text == known:
            return cast(UnknownCells, known)
    raise UserError(f"unknown cells cannot be {text!r}{name_hint(text, get_args(UnknownCells))}")


def with_drawn_places(world: World, robot: Robot, seed: int) -> World:
    """Return the world with a kitchen and tables drawn on its free floor by `seed`, if it names none."""
    if KITCHEN in world.places and any(name.startswith("table_") for name in world.places):
        return world
    floor = _floor(world, robot)
    return dataclasses.replace(world, places={**floor.draw_places(world.start, seed), **world.places})


def _floor(world: World, robot: Robot) -> FreeFloor:
    """Return the free floor: the known floor of a map, else the floor between the solids of a world file."""
    if world.floor is not None:
        return world.floor
    return FreeFloor(reachable(world, robot, MARGIN), 0.0)


def _with_start(world: World, start: SE2, robot: Robot) -> World:
    """Return the world with another start pose. Raises UserError if it is not free."""
    x0, y0, x1, y1 = world.bounds
    at = f"world {world.name}: the start ({start.x:.2f}, {start.y:.2f})"
    free = FreeFloor(reachable(world, robot, MARGIN), 0.0).nearest(start.x, start.y)
    suggestion = f"the nearest free pose is start:='[{free.x:.2f}, {free.y:.2f}, {start.yaw:.2f}]'"
    if not (x0 <= start.x <= x1 and y0 <= start.y <= y1):
        spans = f"x {x0:.2f} to {x1:.2f} and y {y0:.2f} to {y1:.2f} m"
        raise UserError(f"{at} lies outside, the world spans {spans}; {suggestion}")
    if clearance(world.obstacles_at_rest(), start.x, start.y, *ROBOT_SPACE) < robot.circumscribed_radius:
        raise UserError(f"{at} overlaps an obstacle or is too near to one; {suggestion}")
    return dataclasses.replace(world, places={**world.places, "home": start}, start_note="as requested")
