"""Any ROS map is a world: read as Nav2 does, with a free start, places that can be reached, walls that hold."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage
from tests.support.ros_maps import MAPS, RosMap, rooms

from chefbot.errors import UserError
from chefbot.mapping.image_format import MapFormatError
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.load import load_robot
from chefbot.sim import nearby_solids
from chefbot.sim.nearby_solids import NearbySolids
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.load import load_any_world, unknown_cells, with_drawn_places
from chefbot.sim.world.map_world import MapWalls, world_from_map
from chefbot.sim.world.world import World
from chefbot.storage.map_files import load_map
from chefbot.storage.places import places_path, save_places

ROBOT = load_robot("chefbot_lidar")
RADIUS = ROBOT.circumscribed_radius
JUDGED_SEED = 101
DRIVEN = ("room_p5", "turned_a_little", "far_and_turned", "thin_cells", "unknown_is_free", "alpha_scale")


def load(one: RosMap, folder: Path) -> World:
    return load_any_world(str(one.write(folder)), ROBOT, unknown=unknown_cells(one.unknown))


def reached_from(world: World, grid: Grid) -> np.ndarray:
    """Return the cells (h, w) that the robot's centre gets to from the start, without crossing what is not free."""
    blocked = np.pad(grid.cells != FREE, 1, constant_values=True)
    clearance = ndimage.distance_transform_edt(~blocked)[1:-1, 1:-1] * grid.resolution
    labels = ndimage.label(clearance >= RADIUS)[0]
    return labels == labels[grid.cell(world.start.x, world.start.y)]


@pytest.mark.parametrize("one", MAPS, ids=lambda one: one.name)
def test_every_map_loads_with_a_start_and_places(one: RosMap, tmp_path: Path) -> None:
    world = load(one, tmp_path)
    read, true = load_map(tmp_path / f"{one.name}.yaml"), one.grid()
    if true is not None:
        assert np.array_equal(read.cells, true.cells)
        assert (read.resolution, read.origin_x, read.origin_y) == (
            true.resolution,
            true.origin_x,
            true.origin_y,
        )
    assert read.at(world.start.x, world.start.y) == FREE
    assert "largest free area" in world.start_note
    sim = Simulation(ROBOT, world)
    assert sim.lidar().shape == (360,)
    places = with_drawn_places(world, ROBOT, JUDGED_SEED).places
    assert {"home", "kitchen", "table_1"} <= set(places)
    floor = read
    if one.unknown == "free":
        floor = Grid(np.where(read.cells == UNKNOWN, FREE, read.cells), read.resolution, *true_origin(read))
    reached = reached_from(world, floor)
    assert all(reached[read.cell(pose.x, pose.y)] for pose in places.values())
    spots = [pose[:2] for pose in places.values()]
    assert min(math.dist(a, b) for i, a in enumerate(spots) for b in spots[:i]) >= 0.3


def true_origin(grid: Grid) -> tuple[float, float]:
    return grid.origin_x, grid.origin_y


@pytest.mark.parametrize("one", [m for m in MAPS if m.name in DRIVEN], ids=lambda one: one.name)
def test_the_robot_drives_on_the_map(one: RosMap, tmp_path: Path) -> None:
    world = load(one, tmp_path)
    sim = Simulation(ROBOT, world, "real", JUDGED_SEED)
    sim.set_duty(0.5, 0.5)
    for _ in range(300):
        sim.step()
    moved = world.start.between(sim.truth().pose)
    assert moved.x > 0.2 and abs(moved.y) < 0.2
    assert sim.collisions().episodes == 0 and sim.warnings == 0


@given(
    st.integers(0, 2**32 - 1), st.floats(0.0, 1.0), st.sampled_from([1e-3, 0.05, 0.31, 20.0]), st.booleans()
)
@settings(max_examples=60)
def test_wall_boxes_are_exactly_the_solid_cells(
    seed: int, share: float, resolution: float, far: bool
) -> None:
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((19, 14)) < share, OCCUPIED, FREE).astype(np.int8)
    grid = Grid(cells, resolution, *((4e5, -5e6) if far else (-0.7, 0.2)))
    walls = MapWalls(grid, "auto")
    covered = np.zeros(cells.shape, dtype=int)
    for box in walls.boxes:
        edges = [
            (centre - origin + side * half) / resolution
            for centre, origin, half in (
                (box.x, grid.origin_x, box.half[0]),
                (box.y, grid.origin_y, box.half[1]),
            )
            for side in (-1, 1)
        ]
        left, right, low, high = (round(edge) for edge in edges)
        assert np.allclose(edges, (left, right, low, high), atol=1e-5 if not far else 2e-5)
        covered[low:high, left:right] += 1
    assert np.array_equal(covered, cells == OCCUPIED)


@pytest.mark.parametrize("resolution", [0.05, 0.01])
def test_a_wall_of_one_cell_holds_at_full_speed(resolution: float) -> None:
    cells = np.full((round(2.0 / resolution), round(4.0 / resolution)), FREE, np.int8)
    cells[:, round(2.0 / resolution)] = OCCUPIED
    world = world_from_map("wall", Grid(cells, resolution, 0.0, 0.0), RADIUS, SE2(0.5, 1.0, 0.0))
    sim = Simulation(ROBOT, world)
    sim.set_duty(1.0, 1.0)
    for _ in range(1600):
        sim.step()
    assert 1.2 < sim.truth().pose.x < 2.0 - RADIUS + 0.03
    assert sim.collisions().episodes >= 1


@pytest.mark.parametrize("origin", [(0.0, 0.0), (712.3456789, -876.54321), (448_262.351, 5_411_932.777)])
def test_no_beam_passes_where_cells_touch_at_corners(origin: tuple[float, float]) -> None:
    """The lidar stands on the lattice line through corners of a chequered wall, and looks along it."""
    lidar = ROBOT.sensors.lidar
    cells = np.full((80, 80), FREE, np.int8)
    rows = np.arange(80)
    cells[rows, 79 - rows] = OCCUPIED
    on_robot = SE2(lidar.mount.x, lidar.mount.y, 0.0)
    start = SE2(origin[0] + 1.0, origin[1] + 1.0, math.pi / 4) @ on_robot.inverse()
    world = world_from_map("diagonal", Grid(cells, 0.05, *origin), RADIUS, start)
    sim = Simulation(ROBOT, world)
    for step in range(40):
        sim.kidnap(start @ SE2(0.005 * step, 0.0, 0.0))
        ranges = sim.lidar()
        assert ranges[180] == pytest.approx(math.sqrt(2.0) - 0.005 * step, abs=0.001)
        assert float(ranges[160:200].max()) < 1.6
    walls = sorted(wall for wall in NearbySolids(world, ROBOT).touchable if wall.name.startswith("wall_"))
    gaps = [b.x - b.half[0] - a.x - a.half[0] for a, b in pairwise(walls)]
    assert max(gaps) < -1e-5, "cells overlap by more than the rounding of coordinates"


def test_unknown_cells_are_walls_or_free_by_argument() -> None:
    cells = np.full((60, 120), FREE, np.int8)
    cells[:, 60:] = UNKNOWN
    cells[20:24, 20:24] = UNKNOWN
    grid = Grid(cells, 0.05, 0.0, 0.0)
    points = {"large": (5.0, 1.5), "small": (1.1, 1.1), "known": (2.5, 2.5)}
    solid = {
        unknown: [name for name, (x, y) in points.items() if MapWalls(grid, unknown).solid[grid.cell(x, y)]]
        for unknown in ("auto", "wall", "free")
    }
    assert solid == {"auto": ["large"], "wall": ["large", "small"], "free": []}
    world = world_from_map("half", grid, RADIUS, unknown="free")
    assert world.start.x < 3.0, "the start lies on known floor"
    assert world_from_map("half", grid, RADIUS, SE2(5.0, 1.5, 0.0), unknown="free").start.x == 5.0
    with pytest.raises(UserError, match="lies in a wall"):
        world_from_map("half", grid, RADIUS, SE2(5.0, 1.5, 0.0))
    with pytest.raises(UserError, match="did you mean 'wall'"):
        unknown_cells("walls")
    with pytest.raises(UserError, match="only a map has"):
        load_any_world("room", ROBOT, unknown="free")


def test_drawn_places_face_free_floor() -> None:
    world = world_from_map("rooms", Grid(rooms(43, 160, 2), 0.05, 0.0, 0.0), RADIUS)
    for seed in (1, 3, 5, 7):
        places = with_drawn_places(world, ROBOT, seed).places
        for name, pose in places.items():
            ahead = [pose @ SE2(step, 0.0, 0.0) for step in np.arange(0.0, 0.95, 0.05)]
            assert name == "home" or all(world.floor.grid.at(p.x, p.y) == FREE for p in ahead)


def test_places_are_drawn_on_the_side_of_the_start() -> None:
    """The start is too near to the wall for the margin, and the nearest cell with margin is beyond the wall."""
    cells = np.full((60, 160), FREE, np.int8)
    cells[:, 60] = OCCUPIED
    cells[0:40, 20:22], cells[38:40, 20:60] = OCCUPIED, OCCUPIED
    start = SE2(3.0 - RADIUS - 0.005, 1.0, 0.0)
    world = world_from_map("halls", Grid(cells, 0.05, 0.0, 0.0), RADIUS, start)
    places = with_drawn_places(world, ROBOT, 5).places
    assert len(places) == 7
    assert all(1.1 < place.x < 3.0 and place.y < 1.9 for place in places.values())


def dots() -> World:
    """Return a floor of 30 x 30 m with 2500 posts, and aisles without any along its sides."""
    rng = np.random.default_rng(JUDGED_SEED)
    cells = np.where(rng.random((300, 300)) < 0.03, OCCUPIED, FREE).astype(np.int8)
    for aisle in (slice(10, 16), slice(-16, -10)):
        cells[aisle], cells[:, aisle] = FREE, FREE
    return world_from_map("dots", Grid(cells, 0.1, -2.0, -2.0), RADIUS, SE2(-0.7, -0.7, 0.0))


def test_a_large_map_is_simulated_around_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """States and readings are those of a simulation with all solids, also while these are chosen again and again."""
    monkeypatch.setattr(nearby_solids, "SLACK", 0.05)
    part = Simulation(ROBOT, dots(), "real", 1)
    monkeypatch.setattr(nearby_solids, "MAX_UNFILTERED_SOLIDS", 10**6)
    whole = Simulation(ROBOT, dots(), "real", 1)
    assert part._model.ngeom < whole._model.ngeom / 2
    for sim in (part, whole):
        sim.set_duty(0.5, 0.5)
    for _ in range(5):
        for sim in (part, whole):
            for _ in range(100):
                sim.step()
        assert tuple(part.truth().pose) == pytest.approx(tuple(whole.truth().pose), abs=1e-9)
        assert part.lidar() == pytest.approx(whole.lidar(), abs=1e-6)
    assert part.truth().pose.x > -0.1
    for pose in (SE2(26.7, 26.7, 2.0), SE2(-0.7, 13.0, 1.0)):
        for sim in (part, whole):
            sim.kidnap(pose)
        assert part.lidar() == pytest.approx(whole.lidar(), abs=1e-6)
    assert part.collisions() == whole.collisions() and part.time_ns == whole.time_ns


def test_solids_change_only_after_the_robot_moves_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nearby_solids, "MAX_UNFILTERED_SOLIDS", 10)
    world = world_from_map("rooms", Grid(rooms(45, 160, 1), 0.2, 0.0, 0.0), RADIUS)
    solids = NearbySolids(world, ROBOT)
    assert solids.follow(5.0, 5.0)
    assert not solids.follow(5.0 + nearby_solids.SLACK, 5.0)
    near = solids.touchable
    assert solids.follow(25.0, 25.0) and set(near) != set(solids.touchable)


def test_a_start_on_unknown_floor_has_places_around_it() -> None:
    grid = Grid(rooms(47, 120, 2, border=60), 0.05, 0.0, 0.0)
    world = world_from_map("yard", grid, RADIUS, SE2(1.0, 1.0, 0.0), unknown="free")
    places = with_drawn_places(world, ROBOT, 7).places
    assert len(places) == 7 and all(grid.at(pose.x, pose.y) == UNKNOWN for pose in places.values())


def test_places_far_from_the_origin_are_saved_and_loaded(tmp_path: Path) -> None:
    one = next(one for one in MAPS if one.name == "far_away")
    path = one.write(tmp_path)
    start = load_any_world(str(path), ROBOT).start
    save_places(places_path(path), {"home": start, "kitchen": start @ SE2(0.5, 0.0, 0.0)})
    assert tuple(load_any_world(str(path), ROBOT).places["kitchen"]) == pytest.approx(
        (start.x + 0.5, start.y, 0.0), abs=1e-3
    )


def test_a_path_of_another_machine_is_reported_with_the_cure(tmp_path: Path) -> None:
    one = next(one for one in MAPS if one.name == "no_comment")
    path = one.write(tmp_path)
    path.write_text(path.read_text().replace("image: ", "image: /home/somebody/maps/"))
    with pytest.raises(
        MapFormatError, match=r"somebody/maps/no_comment\.pgm does not exist; .*image: no_comment\.pgm"
    ):
        load_any_world(str(path), ROBOT)


def test_a_dropped_box_leaves_the_floor_as_it_is() -> None:
    """The model is compiled again, and the friction under the wheels stays that of the place."""
    sim = Simulation(ROBOT, load_any_world("empty", ROBOT), "real", JUDGED_SEED)
    sim.set_duty(0.3, 0.3)
    for _ in range(100):
        sim.step()
    before = sim._model.geom_friction[sim._wheels, 0].copy()
    sim.drop_box(5.0, 5.0, (0.1, 0.1, 0.1))
    assert sim._model.geom_friction[sim._wheels, 0].tolist() == before.tolist()


@pytest.mark.parametrize(("gap", "touches"), [(0.05, False), (-0.05, True)])
def test_a_box_hangs_above_the_floor(gap: float, touches: bool) -> None:
    sim = Simulation(ROBOT, load_any_world("empty", ROBOT), "real", JUDGED_SEED)
    sim.drop_box(0.6, 0.0, (0.3, 0.3, 0.3), overall_height(ROBOT) + gap)
    sim.set_duty(0.5, 0.5)
    touched = set()
    for _ in range(2000):
        sim.step()
        touched |= set(sim.touching)
    assert ("dropped_1" in touched) == touches
    assert touches or sim.truth().pose.x > 0.8


def test_a_map_in_which_no_robot_fits_names_the_remedy() -> None:
    cells = np.full((20, 20), FREE, np.int8)
    with pytest.raises(UserError, match=r"map tiny: no free floor .*check resolution, negate and thresholds"):
        world_from_map("tiny", Grid(cells, 0.01, 0.0, 0.0), RADIUS)
