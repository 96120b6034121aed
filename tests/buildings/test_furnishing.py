"""Furniture stands within its room, apart from other pieces and clear of doorways; places are within reach."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import box

from chefbot.buildings import furniture
from chefbot.buildings.furnishing import Furnishing, before_doorway
from chefbot.buildings.furniture import PlacedPiece
from chefbot.buildings.interiors import INTERIORS, Interior, add_clutter
from chefbot.buildings.layout import Room, Use
from chefbot.buildings.parameters import draw_numbers
from chefbot.buildings.places import SERVING_DISTANCE, choose_places
from chefbot.buildings.reachable_floor import ReachableFloor
from chefbot.buildings.rectangle import Rectangle
from chefbot.buildings.world_file import Table
from chefbot.maths.se2 import SE2

FLOOR = Rectangle(0.0, 0.0, 7.0, 6.0)
DOORWAY = before_doorway(3.0, 0.0, False, 1.0, 0.8)
AISLE, RADIUS = 0.8, 0.2


def furnished(use: Use, seed: int) -> Furnishing:
    rng = np.random.default_rng(seed)
    kind = "narrow" if use is Use.GATES else "warehouse" if use is Use.RACKS else "office"
    one = Interior(Furnishing(FLOOR, [DOORWAY], AISLE), draw_numbers(kind, {}, rng), RADIUS, rng)
    INTERIORS[use](one)
    add_clutter(one)
    return one.room


@given(st.sampled_from(sorted(INTERIORS)), st.integers(0, 100))
def test_pieces_stand_in_their_room_clear_of_the_doorway(use: Use, seed: int) -> None:
    for placed in furnished(use, seed).pieces:
        assert FLOOR.expanded(1e-3).contains(placed.rect)
        assert not placed.rect.overlaps(DOORWAY)


@given(st.sampled_from(sorted(set(INTERIORS) - {Use.GATES})), st.integers(0, 100))
def test_pieces_leave_an_aisle_between_them(use: Use, seed: int) -> None:
    rects = [placed.rect for placed in furnished(use, seed).pieces]
    near = [(a, b) for i, a in enumerate(rects) for b in rects[:i] if a.expanded(AISLE - 1e-6).overlaps(b)]
    assert near == []


@given(st.integers(0, 100))
def test_a_gate_is_as_wide_as_its_parameters(seed: int) -> None:
    rng = np.random.default_rng(seed)
    numbers = draw_numbers("narrow", {}, rng)
    one = Interior(Furnishing(FLOOR, [], AISLE), numbers, RADIUS, rng)
    INTERIORS[Use.GATES](one)
    left, right = sorted(placed.rect for placed in one.room.pieces)
    assert right.x0 - left.x1 == pytest.approx(2 * RADIUS + numbers["gap"], abs=0.002)
    assert left.x0 == pytest.approx(FLOOR.x0, abs=1e-3) and right.x1 == pytest.approx(FLOOR.x1, abs=1e-3)


@given(st.integers(0, 200))
def test_a_piece_at_a_wall_turns_its_back_to_it(seed: int) -> None:
    room, rng = Furnishing(FLOOR, [], AISLE), np.random.default_rng(seed)
    piece = furniture.desk(rng)
    assert room.at_wall(piece, rng)
    (placed,) = room.pieces
    back = placed.pose @ SE2(0.0, -piece.size[1] / 2, 0.0)
    edges = abs(back.x - FLOOR.x0), abs(back.x - FLOOR.x1), abs(back.y - FLOOR.y0), abs(back.y - FLOOR.y1)
    assert min(edges) < 0.002
    table = next(one for one in placed.elements(lambda name: name) if isinstance(one, Table))
    to_table, to_middle = (math.dist((one.x, one.y), (back.x, back.y)) for one in (table, placed.pose))
    assert to_table < to_middle


def test_rows_fill_the_room_evenly() -> None:
    room = Furnishing(FLOOR, [], AISLE)
    room.in_rows(furniture.cupboard("box", 0.5, 0.5, 1.0), (2.0, 2.0))
    assert len(room.pieces) == 3 * 2
    assert sum(p.pose.x for p in room.pieces) / 6 == pytest.approx(FLOOR.centre[0])


def test_a_hole_is_turned_with_its_piece() -> None:
    piece = furniture.hole(np.random.default_rng(1))
    (hole,) = PlacedPiece(piece, SE2(1.0, 2.0, math.pi / 2)).elements(lambda name: name)
    assert tuple(hole.size) == piece.size[::-1]  # type: ignore[union-attr]


def test_the_reachable_floor_is_on_one_side_of_a_wall() -> None:
    wall = box(4.0, 0.0, 4.1, 6.0)
    floor = ReachableFloor([FLOOR], [wall], RADIUS, 0.05)
    assert floor.holds(2.0, 3.0) and not floor.holds(6.0, 3.0)
    assert not floor.holds(3.75, 3.0), "no room to spare at the wall"
    assert floor.centres.area == pytest.approx((4.0 - RADIUS - 0.05) * 6.0, rel=1e-3)


@pytest.mark.parametrize(("gap", "passes"), [(0.55, True), (0.45, False)])
def test_a_gap_passes_a_robot_that_fits(gap: float, passes: bool) -> None:
    walls = [box(4.0, 0.0, 4.1, 3.0), box(4.0, 3.0 + gap, 4.1, 6.0)]
    floor = ReachableFloor([FLOOR], walls, RADIUS, 0.05)
    assert floor.holds(2.0, 3.0)
    assert floor.holds(6.0, 3.0) == passes


def test_places_are_those_that_can_be_reached() -> None:
    other = Rectangle(7.0, 0.0, 12.0, 6.0)
    rooms = [Room(Use.CORRIDOR, FLOOR), Room(Use.KITCHEN, other)]
    tables = [
        PlacedPiece(furniture.dining_table(np.random.default_rng(1), 0.8, 0), SE2(x, 3.0, 0.0))
        for x in (3.0, 10.0)
    ]
    obstacles = [box(*placed.rect) for placed in tables]
    rng = np.random.default_rng(1)
    joined = ReachableFloor([FLOOR, other], obstacles, RADIUS, 0.05)
    split = ReachableFloor([FLOOR, other], [*obstacles, box(7.0, 0.0, 7.1, 6.0)], RADIUS, 0.05)
    assert choose_places(rooms, tables, joined, RADIUS, 5, rng).keys() == {
        "home",
        "kitchen",
        "table_1",
        "table_2",
    }
    assert choose_places(rooms, tables, split, RADIUS, 5, rng).keys() == {"home", "table_1"}
    assert choose_places(rooms, tables, joined, RADIUS, 1, rng).keys() == {"home", "kitchen", "table_1"}


def test_a_robot_at_a_table_faces_it() -> None:
    table = PlacedPiece(furniture.dining_table(np.random.default_rng(1), 0.8, 0), SE2(3.0, 3.0, 0.0))
    floor = ReachableFloor([FLOOR], [box(*table.rect)], RADIUS, 0.05)
    place = choose_places([Room(Use.CORRIDOR, FLOOR)], [table], floor, RADIUS, 1, np.random.default_rng(1))[
        "table_1"
    ]
    bearing = math.atan2(3.0 - place.y, 3.0 - place.x)
    assert bearing == pytest.approx(place.yaw, abs=1e-6)
    distance = math.dist((place.x, place.y), (3.0, 3.0)) - table.rect.width / 2 - RADIUS
    assert distance == pytest.approx(SERVING_DISTANCE, abs=0.01)
