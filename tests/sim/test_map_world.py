"""Tests worlds that are made from ROS maps, with their start pose and generated places."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from chefbot.errors import ChefbotError, UserError
from chefbot.mapping.image_format import MapFormatError
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.free_floor import MARGIN, FreeFloor
from chefbot.sim.world.load import (
    load_any_world,
    map_to_localize_on,
    parse_start_pose,
    shares_map_frame,
    with_drawn_places,
)
from chefbot.sim.world.map_world import world_from_map
from chefbot.sim.world.shapes import clearance
from chefbot.sim.world.world import ROBOT_SPACE, load_world
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places

ROBOT = load_robot("chefbot_lidar")
RADIUS = ROBOT.circumscribed_radius


def halls(wall: int = 60) -> Grid:
    """Return two halls of 3 m and 6.9 m by 4 m with a wall without a door between them; unknown at the top."""
    cells = np.full((100, 200), FREE, np.int8)
    cells[80:] = UNKNOWN
    cells[:, wall : wall + 2] = OCCUPIED
    return Grid(cells, 0.05, -1.0, 2.0)


def cluttered(seed: int) -> Grid:
    """Return a floor of 40 x 60 cells with random blocks."""
    rng = np.random.default_rng(seed)
    cells = np.full((40, 60), FREE, np.int8)
    for _ in range(int(rng.integers(0, 25))):
        row, column = rng.integers(0, 38), rng.integers(0, 58)
        cells[row : row + rng.integers(1, 5), column : column + rng.integers(1, 9)] = rng.choice(
            [OCCUPIED, UNKNOWN]
        )
    return Grid(cells, 0.1, float(rng.normal()), float(rng.normal()))


def test_the_start_is_the_widest_place_in_the_largest_hall() -> None:
    world = world_from_map("halls", halls(), RADIUS)
    assert (world.start.x, world.start.y) == pytest.approx((5.55, 4.0), abs=3.6)
    assert world.start.x > 2.1, "the larger hall is to the right of the wall"
    assert world.start.y == pytest.approx(4.0, abs=0.06)
    assert "clearance is largest" in world.start_note
    assert world.start == world_from_map("halls", halls(), RADIUS).start
    assert Simulation(ROBOT, world).truth().pose.x == pytest.approx(world.start.x)


@given(st.integers(0, 10_000))
@settings(max_examples=60)
def test_generated_places_are_free_separate_and_reachable(seed: int) -> None:
    floor = FreeFloor(cluttered(seed), RADIUS)
    try:
        start, room = floor.roomiest()
    except UserError as error:
        assert "no free floor" in str(error)
        return
    assert room >= RADIUS + MARGIN - 1e-9
    places = floor.draw_places(start, seed)
    assert places == floor.draw_places(start, seed)
    spots = [start, *places.values()]
    areas = ndimage.label(floor.clearance >= RADIUS + MARGIN)[0]
    assert len({areas[floor.grid.cell(p.x, p.y)] for p in spots} | {0}) == 2, (
        "all places are in one connected area"
    )
    gaps = [math.dist(a[:2], b[:2]) for i, a in enumerate(spots) for b in spots[:i]]
    assert min(gaps, default=1.0) >= 0.3 - 1e-9
    assert not places or {"kitchen", "table_1"} <= set(places)


def test_generated_places_depend_on_the_seed() -> None:
    world = world_from_map("halls", halls(), RADIUS)
    first, second = (with_drawn_places(world, ROBOT, seed) for seed in (1, 2))
    assert set(first.places) == {"home", "kitchen", *(f"table_{i}" for i in range(1, 6))}
    assert first.places["home"] == world.start
    assert first.places != second.places


def test_generated_places_do_not_replace_those_of_a_world() -> None:
    workshop = with_drawn_places(load_world("workshop"), ROBOT, 1)
    assert {"home", "kitchen", "table_1", "table_3"} <= set(workshop.places)
    assert with_drawn_places(load_world("hotel"), ROBOT, 1).places == load_world("hotel").places


@pytest.mark.parametrize(
    ("start", "sentence"),
    [
        (SE2(2.05, 3.0, 0.5), r"\(2\.05, 3\.00\) lies in a wall .*start:='\[1\.\d\d, 2\.98, 0\.50\]'"),
        (SE2(1.9, 3.0, 0.0), "too near to one"),
        (SE2(50.0, 3.0, 0.0), r"lies off the map, which spans x -1\.00 to 9\.00 .*start:='\[8\.7"),
    ],
)
def test_an_occupied_start_is_rejected_with_a_free_pose(start: SE2, sentence: str) -> None:
    with pytest.raises(UserError, match=sentence) as caught:
        world_from_map("halls", halls(), RADIUS, start)
    suggested = parse_start_pose("[" + str(caught.value).rsplit("[", 1)[1].rstrip("'"))
    assert world_from_map("halls", halls(), RADIUS, suggested).start == suggested


def test_a_home_in_a_wall_is_named_as_a_place() -> None:
    in_wall = SE2(2.05, 4.0, 0.0)
    with pytest.raises(
        UserError, match=r"map halls: the place home in .*places.yaml \(2\.05, 4\.00\) lies in a wall"
    ):
        world_from_map("halls", halls(), RADIUS, places={"home": in_wall})
    with pytest.raises(UserError, match=r"map halls: the start \(2\.05, 4\.00\) lies in a wall"):
        world_from_map("halls", halls(), RADIUS, start=in_wall, places={"home": in_wall})


def test_a_map_without_free_space_is_rejected() -> None:
    for cells in (OCCUPIED, UNKNOWN):
        with pytest.raises(UserError, match="no free floor"):
            world_from_map("full", Grid(np.full((30, 30), cells, np.int8), 0.05, 0.0, 0.0), RADIUS)


def test_the_robot_cannot_leave_the_map() -> None:
    world = world_from_map("open", Grid(np.zeros((40, 40), np.int8), 0.1, 0.0, 0.0), RADIUS)
    assert Simulation(ROBOT, world).lidar().max() < 3.0


@pytest.mark.parametrize(
    "text",
    ["1, 2, 3", "[1, 2]", "[1, 2, .nan]", "[1, 2, a]", "[1, true, 2]", "[1, 2, 1e9]", "[1, 2, 90]", "{"],
)
def test_an_invalid_start_is_rejected(text: str) -> None:
    with pytest.raises(ChefbotError, match=r"start:='"):
        parse_start_pose(text)


def test_a_map_file_with_a_places_file_is_a_world(tmp_path: Path) -> None:
    path = save_map(tmp_path / "halls", halls())
    drawn = load_any_world(str(path), ROBOT)
    assert drawn.start == world_from_map("halls", halls(), RADIUS).start
    save_places(places_path(path), {"home": SE2(0.5, 3.0, 1.0), "kitchen": SE2(1.0, 4.0, 0.0)})
    named = load_any_world(str(path), ROBOT)
    assert (named.start.x, named.start.y, named.start.yaw) == pytest.approx((0.5, 3.0, 1.0), abs=1e-3)
    assert with_drawn_places(named, ROBOT, 1).places["kitchen"] == SE2(1.0, 4.0, 0.0)
    assert load_any_world(str(path), ROBOT, "[1.2, 4.2, 0.3]").start == SE2(1.2, 4.2, 0.3)
    places = re.escape(str(places_path(path)))
    for start, sentence in [
        (
            "[6, 4, 0.3]",
            rf"kitchen \(1\.00, 4\.00\) lies in a free area that the robot does not get to .*{places}",
        ),
        ("[0, 0, 0]", "lies off the map"),
    ]:
        with pytest.raises(UserError, match=f"map {re.escape(str(path))}: .*{sentence}"):
            load_any_world(str(path), ROBOT, start)
    for pose, sentence in [
        (SE2(2.05, 3.0, 0.0), "lies in a wall; move it"),
        (SE2(-9.0, 3.0, 0.0), "lies off the map; move it"),
    ]:
        save_places(places_path(path), {"home": SE2(0.5, 3.0, 1.0), "kitchen": pose})
        with pytest.raises(UserError, match=rf"the place kitchen .*{sentence}.* {places}"):
            load_any_world(str(path), ROBOT)


def test_the_localization_map_defaults_to_the_map_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = str(save_map(tmp_path / "halls", halls()))
    assert shares_map_frame(path, "") and shares_map_frame(path, path)
    assert not shares_map_frame(path, "another.yaml") and not shares_map_frame("room", "")
    assert map_to_localize_on(path, "") == Path(path)
    assert map_to_localize_on(path, "mine.yaml") == Path("mine.yaml")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=r"`chefbot demo` makes runs/demo/map\.yaml"):
        map_to_localize_on("room", "")
    Path("runs/demo").mkdir(parents=True)
    save_map(Path("runs/demo/map"), halls())
    assert map_to_localize_on("room", "") == Path("runs/demo/map.yaml")


@pytest.mark.parametrize("text", ["resolution: 0.05\norigin: [0, 0, 0]", "free_thresh: 0.2"])
def test_a_map_without_its_picture_is_reported_as_a_map(tmp_path: Path, text: str) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(text)
    with pytest.raises(MapFormatError, match="image"):
        load_any_world(str(path), ROBOT)


def test_a_start_pose_applies_to_a_built_in_world() -> None:
    assert load_any_world("room", ROBOT, "[0.5, 0.2, 1.0]").start == SE2(0.5, 0.2, 1.0)
    with pytest.raises(UserError, match=r"lies outside, .*nearest free pose is start:='\["):
        load_any_world("room", ROBOT, "[50, 0, 0]")


@pytest.mark.parametrize(
    ("corner", "side", "solid"), [((90, 20), 5, True), ((40, 20), 45, True), ((40, 20), 30, False)]
)
def test_unknown_cells_are_solid_unless_in_shadow(corner: tuple[int, int], side: int, solid: bool) -> None:
    """They are solid at the edge of the map and in areas larger than a shadow of furniture; 2.25 m2 are floor."""
    cells = np.full((95, 120), FREE, np.int8)
    row, column = corner
    cells[row : row + side, column : column + side] = UNKNOWN
    grid = Grid(cells, 0.05, 0.0, 0.0)
    world = world_from_map("hall", grid, RADIUS, SE2(0.5, 0.5, 0.0))
    x, y = grid.centre(row + 2, column + 2)
    assert (clearance(world.static, x, y, *ROBOT_SPACE) <= 0.0) == solid
