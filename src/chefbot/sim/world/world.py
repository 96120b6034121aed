"""A world ready to be simulated: solids, doors, routes and places, read from a world file."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from chefbot.config import parse_config, read_bytes
from chefbot.errors import UserError, nearest
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.sim.world.furniture import (
    box_shape,
    ceiling_shape,
    chair_shapes,
    cylinder_shape,
    door_leaf,
    door_pose,
    table_shapes,
    wall_shapes,
)
from chefbot.sim.world.shapes import Shape, clearance
from chefbot.sim.world.world_spec import Door, Opening, Route, Wall, WorldSpec

WORLD_FOLDER = Path(__file__).parents[1] / "worlds"
MAX_SHAPES = 20_000
ROBOT_SPACE = (0.02, 0.6)
"""Heights in metres in which a place must be free."""

GIVEN_NAME = re.compile(r"^(wall|border|chair|person|dropped)_\d+$|_chair_\d+$|^ceiling$")
"""What solids are called that the world file gives no name."""

Bounds = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class World:
    """Rooms and what stands in them. Metres and radians in the map frame; `home` is where the robot starts.

    static: solids that never move. bounds: (x0, y0, x1, y1) round all of them.
    people: how many walk when nobody asks for another number.
    """

    name: str
    static: tuple[Shape, ...]
    doors: tuple[Door, ...]
    routes: tuple[Route, ...]
    people: int
    places: dict[str, SE2]
    bounds: Bounds
    map: Grid | None = None
    """The map that the world was made of, in the world's frame."""
    start_note: str = ""
    """Why the robot starts where it does, if that is not the file's `home`."""

    @property
    def start(self) -> SE2:
        """Where the robot stands at first: the place `home`."""
        return self.places["home"]

    def door(self, name: str) -> Door:
        """The door of that name; UserError that names the nearest otherwise."""
        for door in self.doors:
            if door.name == name:
                return door
        known = [door.name for door in self.doors]
        raise UserError(f"world {self.name} has no door {name!r}{nearest(name, known)}")

    def shapes_at_rest(self) -> tuple[Shape, ...]:
        """All solids without people, doors as open as the file says."""
        leaves = [door_leaf(door).moved(door_pose(door, door.open)) for door in self.doors]
        return (*self.static, *leaves)


def built_in_worlds() -> dict[str, Path]:
    """Name to file of the worlds that come with the package."""
    return {path.stem: path for path in sorted(WORLD_FOLDER.glob("*.yaml"))}


def load_world(name_or_path: str) -> World:
    """A built-in world by name, or a file by path. UserError with file, key and reason otherwise."""
    path = _find(name_or_path)
    return parse_world(read_bytes(path, "world file"), f"world file {path}")


@lru_cache(maxsize=4)  # demo, simulator and page each ask for the same world
def parse_world(data: bytes, where: str) -> World:
    """A world from YAML text; `where` begins every error sentence."""
    return build_world(parse_config(data, WorldSpec, where), where)


def _find(name_or_path: str) -> Path:
    known = built_in_worlds()
    if name_or_path in known:
        return known[name_or_path]
    if name_or_path.endswith((".yaml", ".yml")) or "/" in name_or_path:
        return Path(name_or_path)
    raise UserError(
        f"no world is called {name_or_path!r}{nearest(name_or_path, known)}; give one of these or a file"
    )


def build_world(spec: WorldSpec, where: str) -> World:
    """The solids of a world file; UserError for what cannot be."""
    _check_names(spec, where)
    _check_walls(spec, where)
    static = _static_shapes(spec)
    if len(static) > MAX_SHAPES:
        raise UserError(f"{where}: {len(static)} solids are too many, at most {MAX_SHAPES} can be simulated")
    places = {name: place.pose for name, place in spec.places.items()}
    bounds = bounds_of(static)
    if spec.ceiling is not None:
        static = (*static, ceiling_shape(bounds, spec.ceiling))
    world = World(spec.name, static, tuple(spec.doors), tuple(spec.routes), spec.people, places, bounds)
    _check_places(world, where)
    return world


def _static_shapes(spec: WorldSpec) -> tuple[Shape, ...]:
    shapes: list[Shape] = []
    for i, wall in enumerate(spec.walls):
        shapes += wall_shapes(wall, f"wall_{i}")
    for table in spec.tables:
        shapes += table_shapes(table)
    for i, chair in enumerate(spec.chairs):
        shapes += chair_shapes(chair, f"chair_{i}")
    shapes += [box_shape(item) for item in spec.boxes]
    shapes += [cylinder_shape(item) for item in spec.cylinders]
    return tuple(shapes)


def bounds_of(shapes: tuple[Shape, ...]) -> Bounds:
    """(x0, y0, x1, y1) round the shapes; a 10 m square round the origin when there are none."""
    if not shapes:
        return (-5.0, -5.0, 5.0, 5.0)
    return (
        min(s.x - s.extent[0] for s in shapes),
        min(s.y - s.extent[1] for s in shapes),
        max(s.x + s.extent[0] for s in shapes),
        max(s.y + s.extent[1] for s in shapes),
    )


def _check_names(spec: WorldSpec, where: str) -> None:
    """Every named thing has a name of its own: collisions are reported by it."""
    for key in ("tables", "boxes", "cylinders", "doors"):
        for i, item in enumerate(getattr(spec, key)):
            if GIVEN_NAME.search(item.name):
                raise UserError(
                    f"{where}: {key}[{i}].name: {item.name!r} is a name that the simulator gives itself"
                )
    seen: dict[str, str] = {}
    for key in ("tables", "boxes", "cylinders", "doors"):
        for i, item in enumerate(getattr(spec, key)):
            if item.name in seen:
                raise UserError(
                    f"{where}: {key}[{i}].name: {item.name!r} is the name of {seen[item.name]} too"
                )
            seen[item.name] = f"{key}[{i}]"


def _check_walls(spec: WorldSpec, where: str) -> None:
    for i, wall in enumerate(spec.walls):
        length = math.dist(wall.start, wall.end)
        if length < wall.thickness:
            raise UserError(f"{where}: walls[{i}]: is {length:.3g} m long, shorter than it is thick")
        for j, opening in enumerate(wall.openings):
            _check_opening(opening, wall, length, f"{where}: walls[{i}].openings[{j}]")


def _check_opening(opening: Opening, wall: Wall, length: float, where: str) -> None:
    if opening.at - opening.width / 2 < 0 or opening.at + opening.width / 2 > length:
        raise UserError(f"{where}: reaches beyond the wall, which is {length:.3g} m long")
    if opening.sill >= opening.height:
        raise UserError(f"{where}: its sill is not below its upper edge ('height')")
    for other in wall.openings:
        if other is not opening and abs(other.at - opening.at) < (other.width + opening.width) / 2:
            raise UserError(f"{where}: overlaps another opening of the same wall")


def _check_places(world: World, where: str) -> None:
    if "home" not in world.places:
        raise UserError(f"{where}: places: 'home' is missing, where the robot starts")
    x0, y0, x1, y1 = world.bounds
    solids = world.shapes_at_rest()
    for name, place in world.places.items():
        if not (x0 <= place.x <= x1 and y0 <= place.y <= y1):
            raise UserError(
                f"{where}: places.{name}: lies outside the world ({x0:.3g}..{x1:.3g} m, {y0:.3g}..{y1:.3g} m)"
            )
        if clearance(solids, place.x, place.y, *ROBOT_SPACE) <= 0.0:
            raise UserError(f"{where}: places.{name}: lies inside {nearest_name(solids, place)}; move it")


def nearest_name(shapes: tuple[Shape, ...], at: SE2) -> str:
    """Name of the thing nearest to a point in the robot's space."""
    return min(shapes, key=lambda s: clearance([s], at.x, at.y, *ROBOT_SPACE)).name.split("/")[0]
