"""Rooms tile the floor, every room has a path to every other one, and walls stand where two rooms meet."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.buildings.floor_plans import FLOOR_PLANS
from chefbot.buildings.layout import (
    Room,
    Side,
    Use,
    connecting_sides,
    doorway,
    is_open,
    outer_sides,
    shared_sides,
)
from chefbot.buildings.parameters import draw_numbers
from chefbot.buildings.reachable_floor import floor_of_door, floor_of_wall
from chefbot.buildings.rectangle import Rectangle, around, cuts, random_cuts
from chefbot.buildings.walls import THICKNESS, doors_of, walls_of

LEFT, RIGHT = Rectangle(0.0, 0.0, 4.0, 3.0), Rectangle(4.0, 1.0, 7.0, 5.0)
PAIR = [Room(Use.OFFICE, LEFT), Room(Use.STORE, RIGHT)]
SHARED = Side(0, 1, True, 4.0, 1.0, 3.0)


def rooms_of(kind: str, seed: int) -> list[Room]:
    rng = np.random.default_rng(seed)
    return FLOOR_PLANS[kind](draw_numbers(kind, {}, rng), rng)


@given(st.sampled_from(sorted(FLOOR_PLANS)), st.integers(0, 200))
def test_rooms_do_not_overlap(kind: str, seed: int) -> None:
    rects = [room.rect.expanded(-1e-6) for room in rooms_of(kind, seed)]
    assert not any(a.overlaps(b) for i, a in enumerate(rects) for b in rects[:i])
    assert all(rect.width > 0.9 and rect.depth > 0.9 for rect in rects)


@given(st.sampled_from(sorted(FLOOR_PLANS)), st.integers(0, 200))
def test_every_room_has_a_path_to_every_other(kind: str, seed: int) -> None:
    rooms = rooms_of(kind, seed)
    sides = shared_sides(rooms)
    chosen = connecting_sides(rooms, sides, 0.8, 0.0, np.random.default_rng(seed))
    passages = [*chosen, *(side for side in sides if is_open(side, rooms))]
    reached, grown = {next(i for i, room in enumerate(rooms) if room.use is not Use.SOLID)}, True
    while grown:
        more = {n for side in passages for n in (side.a, side.b) if reached & {side.a, side.b}}
        grown = not more <= reached
        reached |= more
    assert reached == {i for i, room in enumerate(rooms) if room.use is not Use.SOLID}


@given(st.sampled_from(sorted(FLOOR_PLANS)), st.integers(0, 200))
def test_sides_cover_the_outline_of_every_room_once(kind: str, seed: int) -> None:
    rooms = rooms_of(kind, seed)
    shared = shared_sides(rooms)
    lengths = [0.0] * len(rooms)
    for side in [*shared, *outer_sides(rooms, shared)]:
        lengths[side.a] += side.length
        if side.b >= 0:
            lengths[side.b] += side.length
    for room, length in zip(rooms, lengths, strict=True):
        assert length == pytest.approx(2 * (room.rect.width + room.rect.depth), abs=1e-6)


def test_two_rooms_share_the_part_where_they_touch() -> None:
    assert shared_sides(PAIR) == [SHARED]
    beside = [s for s in outer_sides(PAIR, [SHARED]) if s.vertical and s.at == 4.0]
    assert sorted((s.a, s.low, s.high) for s in beside) == [(0, 0.0, 1.0), (1, 3.0, 5.0)]


@given(st.integers(0, 100), st.floats(0.5, 1.5))
def test_a_doorway_keeps_off_the_corners(seed: int, width: float) -> None:
    one = doorway(SHARED, width, -1.0, np.random.default_rng(seed))
    assert one.centre - width / 2 >= SHARED.low + 0.14
    assert one.centre + width / 2 <= SHARED.high - 0.14


def test_rooms_built_alike_open_at_their_lower_side_only() -> None:
    below = Room(Use.CORRIDOR, Rectangle(0.0, -2.0, 8.0, 0.0))
    twins = [Room(Use.OFFICE, Rectangle(4.0 * i, 0.0, 4.0 * (i + 1), 3.0), 1) for i in range(2)]
    above = Room(Use.CORRIDOR, Rectangle(0.0, 3.0, 8.0, 5.0))
    rooms = [below, *twins, above, Room(Use.CORRIDOR, Rectangle(8.0, -2.0, 10.0, 5.0))]
    chosen = connecting_sides(rooms, shared_sides(rooms), 0.8, 1.0, np.random.default_rng(1))
    assert {(s.a, s.b) for s in chosen} == {(0, 1), (0, 2)}


def test_walls_have_a_gap_at_a_doorway_and_the_leaf_fits_it() -> None:
    one = doorway(SHARED, 0.9, 0.0, np.random.default_rng(3))
    walls = walls_of(PAIR, [SHARED], [one], 2.5, 0.0, np.random.default_rng(3))
    solid = [floor for wall in walls for floor in floor_of_wall(wall)]
    (leaf,) = doors_of([one])
    middle = around(4.0, one.centre, 0.05, 0.8)
    assert not any(floor.intersects(_box(middle)) for floor in solid)
    assert floor_of_door(leaf).area == pytest.approx(0.9 * leaf.thickness, rel=1e-3)
    assert floor_of_door(leaf).intersects(_box(middle)), "closed, it bars the doorway"
    assert not any(floor.buffer(-0.03).intersects(floor_of_door(leaf)) for floor in solid)


def test_walls_of_glass_stand_between_rooms_only() -> None:
    walls = walls_of(PAIR, [SHARED], [], 2.5, 1.0, np.random.default_rng(3))
    (glass,) = [wall for wall in walls if wall.material == "glass"]
    assert (glass.start, glass.end) == ([4.0, 1.0], [4.0, 3.0])
    solid = sum(math.dist(wall.start, wall.end) for wall in walls if wall.material == "solid")
    assert solid == pytest.approx(2 * (4 + 3) + 2 * (3 + 4) - 2 * 2.0)
    assert {wall.thickness for wall in walls} == {THICKNESS}


@given(st.floats(-50.0, 50.0), st.floats(1.0, 80.0), st.lists(st.floats(0.5, 5.0), min_size=1, max_size=9))
def test_cuts_leave_no_gap(low: float, length: float, parts: list[float]) -> None:
    intervals = cuts(low, low + length, parts)
    assert intervals[0][0] == low and intervals[-1][1] == low + length
    assert all(a[1] == b[0] for a, b in pairwise(intervals))
    assert len(intervals) == len(parts)


@given(st.floats(3.0, 60.0), st.integers(0, 100))
def test_random_cuts_are_near_the_wanted_length(length: float, seed: int) -> None:
    parts = [b - a for a, b in random_cuts(0.0, length, (3.0, 5.0), np.random.default_rng(seed))]
    assert sum(parts) == pytest.approx(length)
    assert all(1.8 < part < 8.0 for part in parts)


def _box(rect: Rectangle):  # type: ignore[no-untyped-def]
    from shapely import box

    return box(*rect)
