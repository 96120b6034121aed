"""Tests the built-in worlds, floor plans, and the error messages for world files."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.config import ConfigError
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.grid import FREE, OCCUPIED, Grid
from chefbot.maths.se2 import SE2
from chefbot.robot.geometry.layout import ground_clearance, overall_height
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.sim.rays import lidar_angles
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.floor_plan import floor_plan, reachable
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.map_world import merged_rectangles, world_from_map
from chefbot.sim.world.shapes import box, cylinder, distance
from chefbot.sim.world.world import World, built_in_worlds, load_world, parse_world

ROBOT = load_robot("chefbot_lidar")


@pytest.fixture(params=sorted(built_in_worlds()))
def world(request: pytest.FixtureRequest) -> World:
    return load_world(request.param)


@pytest.mark.parametrize("robot_name", sorted(built_in_robots()))
def test_every_place_is_reachable_with_clearance(world: World, robot_name: str) -> None:
    robot = load_robot(robot_name)
    # A rectangular robot needs the circle around it only to turn, for which 5 cm are enough.
    margin = 0.05 if robot.footprint.corners else 0.2
    plan = reachable(world, robot, margin)
    assert {name: plan.at(p.x, p.y) for name, p in world.places.items()} == dict.fromkeys(world.places, FREE)
    assert world.start == SE2(0.0, 0.0, 0.0)


def test_every_robot_stands_still_in_every_world(world: World) -> None:
    for name in built_in_robots():
        sim = Simulation(load_robot(name), world)
        for _ in range(200):
            sim.step()
        assert sim.warnings == 0
        assert sim.collisions() == (0, ())
        assert sim.truth().pose.distance(world.start) < 0.001


def test_routes_do_not_cross_furniture(world: World) -> None:
    solids = [s for s in world.shapes_at_rest() if s.bottom < 1.8]
    for route in world.routes:
        points, t = np.array(route.points), np.linspace(0.0, 1.0, 200)[:, None]
        for a, b in pairwise(points):
            line = a + t * (b - a)
            gaps = {s.name: float(distance(s, line[:, 0], line[:, 1]).min()) for s in solids}
            nearest = min(gaps, key=lambda name: gaps[name])
            assert gaps[nearest] > PERSON_RADIUS + 0.04, (nearest, a, b)


def test_the_hotel_has_its_places_doors_and_routes() -> None:
    hotel = load_world("hotel")
    assert {"home", "kitchen", "reception", *(f"table_{i}" for i in range(1, 10))} <= set(hotel.places)
    x0, y0, x1, y1 = hotel.bounds
    assert (x1 - x0, y1 - y0) == pytest.approx((15.0, 12.0), abs=0.2)
    assert len(hotel.doors) >= 2 and len(hotel.routes) >= 3
    for i in range(1, 10):  # the robot faces the table from its side
        place, table = (
            hotel.places[f"table_{i}"],
            next(s for s in hotel.static if s.name == f"dining_{i}/top"),
        )
        bearing = math.atan2(table.y - place.y, table.x - place.x)
        assert abs(math.remainder(place.yaw - bearing, 2 * math.pi)) < math.radians(25)
        assert place.distance(SE2(table.x, table.y, 0.0)) < 1.0


def test_lidar_hits_the_occupied_cells_of_the_floor_plan(world: World) -> None:
    lidar = ROBOT.sensors.lidar
    assert lidar is not None
    plan = floor_plan(world, lidar.mount.z)
    angles = lidar_angles(lidar)
    hits = 0
    for pose in world.places.values():
        sim = Simulation(ROBOT, world, start=pose)
        ranges = sim.lidar().astype(np.float64)
        for r, a in zip(ranges[np.isfinite(ranges)], angles[np.isfinite(ranges)], strict=True):
            x, y = pose.x + r * math.cos(pose.yaw + a), pose.y + r * math.sin(pose.yaw + a)
            row, column = plan.cell(x, y)
            assert (plan.cells[row - 1 : row + 2, column - 1 : column + 2] == OCCUPIED).any(), (pose, a)
            hits += 1
    assert hits > 300 * len(world.places) or world.name == "empty"


def test_beams_cross_only_free_cells_of_the_floor_plan() -> None:
    room, lidar = load_world("room"), ROBOT.sensors.lidar
    assert lidar is not None
    plan = floor_plan(room, lidar.mount.z)
    ranges = Simulation(ROBOT, room).lidar()
    for r, a in zip(ranges.tolist(), lidar_angles(lidar).tolist(), strict=True):
        for s in np.arange(0.1, r - 0.1, 0.05).tolist() if math.isfinite(r) else ():
            assert floor_touches(plan, s * math.cos(a), s * math.sin(a))


def floor_touches(plan: Grid, x: float, y: float) -> bool:
    """Return whether the cell or a neighbour is free, as a cell that a solid covers in part may be occupied."""
    row, column = plan.cell(x, y)
    return bool((plan.cells[row - 1 : row + 2, column - 1 : column + 2] == FREE).any())


def free_area(grid: Grid) -> float:
    return float(np.count_nonzero(grid.cells == FREE)) * grid.resolution**2


def test_solids_outside_the_slice_are_not_in_the_plan() -> None:
    room = load_world("room")
    table = next(s for s in room.static if s.name == "dining_table/top")
    assert floor_plan(room, 0.2).at(table.x, table.y) == FREE
    assert floor_plan(room, 0.0, 1.0).at(table.x, table.y) == OCCUPIED
    body = floor_plan(room, ground_clearance(ROBOT), overall_height(ROBOT))
    assert free_area(floor_plan(room, 0.2)) > free_area(body)
    assert free_area(reachable(room, ROBOT)) < free_area(body) < 5.0 * 4.0


def test_closed_rooms_are_not_explorable() -> None:
    closed = parse_world(
        b"""
name: two_rooms
walls:
  - {start: [-2 m, -2 m], end: [6 m, -2 m]}
  - {start: [6 m, -2 m], end: [6 m, 2 m]}
  - {start: [6 m, 2 m], end: [-2 m, 2 m]}
  - {start: [-2 m, 2 m], end: [-2 m, -2 m]}
  - {start: [2 m, -2 m], end: [2 m, 2 m], openings: [{at: 2 m, width: 1 m}]}
doors:
  - {name: door, x: 2 m, y: -0.5 m, yaw: 90 deg, width: 1 m, open: 0.0}
places: {home: {x: 0 m, y: 0 m}}
""",
        "world file test",
    )
    plan = floor_plan(closed, 0.2)
    assert plan.at(0.0, 0.0) == FREE
    assert plan.at(4.0, 0.0) == -1
    assert plan.at(-2.3, 0.0) == -1
    assert free_area(plan) == pytest.approx(3.88 * 3.88, rel=0.04)


VALID = """
name: small
walls: [{start: [-2 m, -2 m], end: [2 m, -2 m], openings: [{at: 1 m, width: 0.9 m}]}]
boxes: [{name: crate, x: 1 m, y: 1 m, size: [0.5 m, 0.5 m, 0.5 m]}]
places: {home: {x: 0 m, y: 0 m}}
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.5 m]", "-0.5 m]", r"boxes\[0\]\.size\[2\]"),
        ("0.5 m]", ".nan m]", r"boxes\[0\]\.size\[2\]"),
        ("[0.5 m, 0.5 m, 0.5 m]", "[0.5 m, 0.5 m]", r"boxes\[0\]\.size"),
        ("x: 1 m", "x: 1", r"boxes\[0\]\.x.*unit"),
        ("x: 1 m", "x: .inf m", r"boxes\[0\]\.x"),
        ("x: 1 m", "x: 1e9 m", r"boxes\[0\]\.x"),
        ("name: crate", "nam: crate", "did you mean 'name'"),
        ("home: {x: 0 m", "home: {x: 1.9 m, yaw: .nan rad", "home.yaw"),
        ("home: {x: 0 m, y: 0 m}", "home: {x: 1 m, y: 1 m}", r"places\.home.*inside crate"),
        ("home: {x: 0 m, y: 0 m}", "home: {x: 1 m, y: 9 m}", r"places\.home.*outside"),
        ("home:", "house:", "'home' is missing"),
        ("end: [2 m, -2 m]", "end: [-2 m, -2 m]", r"walls\[0\].*shorter"),
        ("at: 1 m", "at: 3.8 m", r"walls\[0\]\.openings\[0\].*beyond the wall"),
        ("width: 0.9 m", "width: 0.9 m, sill: 3 m", r"openings\[0\].*sill"),
        ("{at: 1 m, width: 0.9 m}", "{at: 1 m, width: 0.9 m}, {at: 1.5 m, width: 0.9 m}", "overlaps another"),
        ("places:", "people: 5000\nplaces:", "people"),
        ("name: crate", "name: wall_0", r"boxes\[0\]\.name.*gives itself"),
        (
            "places:",
            "cylinders: [{name: crate, x: 0 m, y: 1 m, radius: 1 m, height: 1 m}]\nplaces:",
            "name of",
        ),
    ],
)
def test_world_file_errors_name_file_and_key(old: str, new: str, message: str) -> None:
    assert old in VALID
    parse_world(VALID.encode(), "world file small.yaml")
    with pytest.raises(ChefbotError, match=message) as error:
        parse_world(VALID.replace(old, new, 1).encode(), "world file small.yaml")
    assert str(error.value).startswith("world file small.yaml")


def test_a_box_may_have_the_name_of_a_robot_part() -> None:
    for name in ("floor", "payload", "base_link", "wheel_left"):
        world = parse_world(VALID.replace("crate", name).encode(), "world file small.yaml")
        sim = Simulation(ROBOT, world, start=SE2(0.5, 1.0, 0.0))
        sim.set_duty(0.5, 0.5)
        for _ in range(400):
            sim.step()
        assert sim.collisions() == (1, (name,))


def test_unknown_worlds_are_rejected_with_the_nearest_name() -> None:
    with pytest.raises(UserError, match="did you mean 'hotel'"):
        load_world("hotell")
    with pytest.raises(ConfigError, match="does not exist"):
        load_world("no/such/world.yaml")


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_merged_rectangles_cover_each_cell_exactly_once(seed: int, share: float) -> None:
    cells = np.random.default_rng(seed).random((17, 23)) < share
    covered = np.zeros(cells.shape, dtype=int)
    for row, column, rows, columns in merged_rectangles(cells):
        covered[row : row + rows, column : column + columns] += 1
    assert (covered == cells).all()


def test_a_map_of_a_world_reproduces_the_world() -> None:
    room = load_world("room")
    plan = floor_plan(room, 0.0, 2.0)
    world = world_from_map(
        "copy", plan, ROBOT.circumscribed_radius, SE2(0.0, 0.0, 0.0), places={"corner": SE2(1.0, 1.0, 0.0)}
    )
    again = floor_plan(world, 0.5)
    rows, columns = np.indices(plan.cells.shape)
    copied = [again.at(*plan.centre(r, c)) for r, c in zip(rows.ravel(), columns.ravel(), strict=True)]
    copy = np.array(copied).reshape(plan.cells.shape)
    assert (copy[plan.cells == OCCUPIED] == OCCUPIED).all()
    assert (plan.cells[copy == FREE] == FREE).all()
    assert np.count_nonzero(copy == FREE) > 0.8 * np.count_nonzero(plan.cells == FREE)
    assert set(world.places) == {"home", "corner"}
    occupied = np.count_nonzero(plan.cells == OCCUPIED)
    assert len(world.static) < occupied / 5
    front = Simulation(ROBOT, world).lidar()[180]
    assert front == pytest.approx(Simulation(ROBOT, room).lidar()[180], abs=0.06)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3), st.floats(0.1, 2), st.floats(0.1, 2))
def test_distance_to_a_box_is_to_its_nearest_point(
    x: float, y: float, yaw: float, sx: float, sy: float
) -> None:
    shape = box("b", SE2(0.5, -0.25, yaw), 0.0, (sx, sy, 1.0), (0, 0, 0))
    u, v = np.meshgrid(np.linspace(-sx / 2, sx / 2, 101), np.linspace(-sy / 2, sy / 2, 101))
    points = SE2(0.5, -0.25, yaw).apply(np.column_stack([u.ravel(), v.ravel()]))
    nearest = np.hypot(points[:, 0] - x, points[:, 1] - y).min()
    assert float(distance(shape, np.array(x), np.array(y))) == pytest.approx(nearest, abs=0.03)


def test_distance_to_a_cylinder_is_to_its_surface() -> None:
    shape = cylinder("c", (1.0, 0.0), 0.0, 0.5, 1.0, (0, 0, 0))
    assert distance(shape, np.array([3.0, 1.0]), np.array([0.0, 0.2])).tolist() == [1.5, 0.0]
