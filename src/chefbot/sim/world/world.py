"""A world ready to be simulated: solids, doors, routes and named places, read from a world file."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from chefbot.buildings.people_spec import PeopleSpec, people_spec
from chefbot.buildings.world_file import Carpet, Door, FloorHole, Opening, Route, Wall, WallTag, WorldSpec
from chefbot.config import build, find_file, parse_yaml, read_bytes
from chefbot.errors import UserError, name_hint
from chefbot.file_kinds import WORLD, check_kind, check_no_picture
from chefbot.maths.se2 import SE2
from chefbot.robot.sensors import TAG_COUNTS
from chefbot.sim.world.floor import over_holes
from chefbot.sim.world.free_floor import FreeFloor
from chefbot.sim.world.furniture import (
    box_shape,
    ceiling_shape,
    chair_shapes,
    cylinder_shape,
    door_leaf,
    door_pose,
    table_shapes,
    tag_shape,
    wall_shapes,
)
from chefbot.sim.world.shapes import SimulatedShape, clearance

WORLD_FOLDER = Path(__file__).parents[1] / "worlds"
MAX_SHAPES = 20_000
"""Maximum number of solids of a world file; a map may have any number."""
ROBOT_SPACE = (0.02, 0.6)
"""Range of heights in metres in which a place must be free."""

RESERVED_NAME = re.compile(r"^(wall|border|chair|person|dropped|tag)_\d+$|_chair_\d+$|^ceiling$")
"""Names that the simulator gives to solids without a name in the world file."""

Bounds = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class World:
    """A building with its furniture. Metres and radians in the map frame; `home` is where the robot starts.

    static: solids that never move. bounds: (x0, y0, x1, y1) around all of them.
    people: who walks about by default.
    """

    name: str
    static: tuple[SimulatedShape, ...]
    doors: tuple[Door, ...]
    routes: tuple[Route, ...]
    people: PeopleSpec
    places: dict[str, SE2]
    bounds: Bounds
    floor: FreeFloor | None = None
    """Free floor of the map that the world was made from, in the world's frame."""
    start_note: str = ""
    """Reason for the start pose, if it is not the file's `home`."""
    holes: tuple[FloorHole, ...] = ()
    carpets: tuple[Carpet, ...] = ()
    tags: tuple[WallTag, ...] = ()

    @property
    def start(self) -> SE2:
        """Start pose of the robot: the place `home`."""
        return self.places["home"]

    def door(self, name: str) -> Door:
        """Return the door with this name. Raises UserError with the nearest known name if there is none."""
        for door in self.doors:
            if door.name == name:
                return door
        names = [door.name for door in self.doors]
        raise UserError(f"world {self.name} has no door {name!r}{name_hint(name, names)}")

    def shapes_at_rest(self) -> tuple[SimulatedShape, ...]:
        """Return all solids without people, with doors opened as the file specifies."""
        leaves = [door_leaf(door).transformed(door_pose(door, door.open)) for door in self.doors]
        return (*self.static, *leaves)

    def obstacles_at_rest(self) -> tuple[SimulatedShape, ...]:
        """Return all that a robot must keep off at rest: the solids, and the holes as if they were solids."""
        return (*self.shapes_at_rest(), *over_holes(self.holes, ROBOT_SPACE[1]))


def built_in_worlds() -> dict[str, Path]:
    """Return the worlds that come with the package as name to file path."""
    return {path.stem: path for path in sorted(WORLD_FOLDER.glob("*.yaml"))}


def load_world(name_or_path: str) -> World:
    """Load a built-in world by name or a world file by path. Raises UserError with file, key and reason."""
    check_no_picture(Path(name_or_path), WORLD, f"world file {name_or_path}", UserError)
    path = find_file("world", name_or_path, built_in_worlds(), UserError)
    return parse_world(read_bytes(path, "world file"), f"world file {path}")


@lru_cache(maxsize=4)  # demo, simulator and web UI each load the same world
def parse_world(data: bytes, where: str) -> World:
    """Parse a world from YAML text; `where` begins every error message."""
    content = parse_yaml(data, where)
    check_kind(content, WORLD, where, UserError)
    return build_world(build(content, WorldSpec, where), where)


def build_world(spec: WorldSpec, where: str) -> World:
    """Build the solids of a world file. Raises UserError for contradictions in it."""
    _check_names(spec, where)
    _check_walls(spec, where)
    _check_tags(spec, where)
    static = _static_shapes(spec)
    if len(static) > MAX_SHAPES:
        raise UserError(f"{where}: {len(static)} solids are too many, at most {MAX_SHAPES} can be simulated")
    places = {name: place.pose for name, place in spec.places.items()}
    bounds = bounds_of(static)
    if spec.ceiling is not None:
        static = (*static, ceiling_shape(bounds, spec.ceiling))
    world = World(
        spec.name,
        static,
        tuple(spec.doors),
        tuple(spec.routes),
        people_spec(spec.people),
        places,
        bounds,
        holes=tuple(spec.holes),
        carpets=tuple(spec.carpets),
        tags=tuple(spec.tags),
    )
    _check_places(world, where)
    return world


def _static_shapes(spec: WorldSpec) -> tuple[SimulatedShape, ...]:
    shapes: list[SimulatedShape] = []
    for i, wall in enumerate(spec.walls):
        shapes += wall_shapes(wall, f"wall_{i}")
    for table in spec.tables:
        shapes += table_shapes(table)
    for i, chair in enumerate(spec.chairs):
        shapes += chair_shapes(chair, f"chair_{i}")
    shapes += [box_shape(item) for item in spec.boxes]
    shapes += [cylinder_shape(item) for item in spec.cylinders]
    shapes += [tag_shape(tag, f"tag_{i}") for i, tag in enumerate(spec.tags)]
    return tuple(shapes)


def bounds_of(shapes: tuple[SimulatedShape, ...]) -> Bounds:
    """Return (x0, y0, x1, y1) around the shapes; a 10 m square around the origin if there are none."""
    if not shapes:
        return (-5.0, -5.0, 5.0, 5.0)
    return (
        min(s.x - s.extent[0] for s in shapes),
        min(s.y - s.extent[1] for s in shapes),
        max(s.x + s.extent[0] for s in shapes),
        max(s.y + s.extent[1] for s in shapes),
    )


def _check_names(spec: WorldSpec, where: str) -> None:
    """Check that names are unique and not reserved: collisions are reported by name."""
    named = [
        (f"{key}[{i}]", item.name)
        for key in ("tables", "boxes", "cylinders", "doors", "holes")
        for i, item in enumerate(getattr(spec, key))
    ]
    for key, name in named:
        if RESERVED_NAME.search(name):
            raise UserError(f"{where}: {key}.name: {name!r} is a name that the simulator gives itself")
    seen: dict[str, str] = {}
    for key, name in named:
        if name in seen:
            raise UserError(f"{where}: {key}.name: {name!r} is the name of {seen[name]} too")
        seen[name] = key


def _check_walls(spec: WorldSpec, where: str) -> None:
    for i, wall in enumerate(spec.walls):
        length = math.dist(wall.start, wall.end)
        if length < wall.thickness:
            raise UserError(f"{where}: walls[{i}]: is {length:.3g} m long, shorter than it is thick")
        for j, opening in enumerate(wall.openings):
            _check_opening(opening, wall, length, f"{where}: walls[{i}].openings[{j}]")


def _check_tags(spec: WorldSpec, where: str) -> None:
    for i, tag in enumerate(spec.tags):
        n = TAG_COUNTS[tag.family]
        if tag.id >= n:
            raise UserError(
                f"{where}: tags[{i}].id: family {tag.family} has the tags 0 to {n - 1}, not {tag.id}"
            )
        if tag.z < tag.board_size / 2.0:
            raise UserError(f"{where}: tags[{i}].z: its lower edge is below the floor")


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
    solids = world.obstacles_at_rest()
    for name, place in world.places.items():
        if not (x0 <= place.x <= x1 and y0 <= place.y <= y1):
            raise UserError(
                f"{where}: places.{name}: lies outside the world ({x0:.3g}..{x1:.3g} m, {y0:.3g}..{y1:.3g} m)"
            )
        if clearance(solids, place.x, place.y, *ROBOT_SPACE) <= 0.0:
            raise UserError(
                f"{where}: places.{name}: lies inside {nearest_name(solids, place, ROBOT_SPACE)}; move it"
            )


def nearest_name(shapes: Sequence[SimulatedShape], at: SE2, heights: tuple[float, float]) -> str:
    """Return the name of the object nearest to a point within a range of heights."""
    return min(shapes, key=lambda s: clearance([s], at.x, at.y, *heights)).name.split("/")[0]
