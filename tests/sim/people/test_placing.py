"""Tests where people stand at first."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.sim.people.scenes import room, two_rooms

from chefbot.errors import UserError
from chefbot.sim.people.floor import PeopleFloor
from chefbot.sim.people.placing import GROUP_REACH, PERSONAL_SPACE, place_people
from chefbot.sim.world.furniture import PERSON_RADIUS

ROOM = PeopleFloor(room(8.0, 6.0), (0.0, 0.0, 8.0, 6.0), (1.0, 1.0))
ROBOT = (2.0, 2.0, 0.3)


def placed(floor: PeopleFloor, leaders, seed: int = 1, occupied=(ROBOT,)) -> np.ndarray:
    return place_people(floor, occupied, leaders, np.random.default_rng(seed).spawn(len(leaders)))


@settings(max_examples=30)
@given(
    st.integers(0, 10_000),
    st.integers(0, 10),
    st.lists(st.tuples(st.floats(1, 7), st.floats(1, 5)), max_size=3),
)
def test_people_stand_on_free_floor_and_apart(seed: int, count: int, chairs) -> None:
    occupied = [ROBOT, *((x, y, 0.25) for x, y in chairs)]
    positions = placed(ROOM, [None] * count, seed, occupied)
    assert positions.shape == (count, 2)
    for k, (x, y) in enumerate(positions.tolist()):
        assert ROOM.fits(x, y)
        for cx, cy, radius in [*occupied, *((*other, PERSON_RADIUS) for other in positions[:k].tolist())]:
            assert math.dist((x, y), (cx, cy)) - radius - PERSON_RADIUS > PERSONAL_SPACE


@pytest.mark.parametrize("seed", range(8))
def test_a_group_stands_together_on_one_side_of_a_wall(seed: int) -> None:
    floor = PeopleFloor(two_rooms(), (-0.1, -0.1, 8.1, 4.1), (1.0, 1.0))
    first, *others = placed(floor, [None, 0, 0], seed, [(0.5, 0.5, 0.2)]).tolist()
    for other in others:
        assert max(abs(a - b) for a, b in zip(first, other, strict=True)) <= GROUP_REACH
        assert floor.is_clear(*first, *other, PERSON_RADIUS)


def test_a_crowded_member_of_a_group_stands_elsewhere() -> None:
    around = [(x, y, 0.3) for x in np.arange(0.5, 8.0, 0.6) for y in np.arange(0.5, 4.0, 0.6)]
    alone = placed(ROOM, [None], 1, around)
    assert alone[0, 1] > 3.9
    crowded = place_people(ROOM, [*around, (*alone[0], 2.2)], [None, 0], np.random.default_rng(2).spawn(2))
    assert np.hypot(*(crowded[1] - crowded[0])) > PERSONAL_SPACE


def test_each_person_is_placed_by_a_generator_of_its_own() -> None:
    few, many = placed(ROOM, [None] * 3), placed(ROOM, [None] * 6)
    assert np.array_equal(few, many[:3])
    assert not np.array_equal(few, placed(ROOM, [None] * 3, seed=2))


def test_nobody_needs_a_robot_to_be_placed() -> None:
    assert ROOM.fits(*placed(ROOM, [None], occupied=())[0])


@pytest.mark.parametrize(("width", "count", "number"), [(0.4, 1, 1), (2.0, 9, r"[2-9]")])
def test_without_room_the_person_is_named(width: float, count: int, number) -> None:
    floor = PeopleFloor(room(width, width), (0.0, 0.0, width, width), (width / 2, width / 2))
    with pytest.raises(UserError, match=rf"no room for person {number} in this world"):
        placed(floor, [None] * count, occupied=[(9.0, 9.0, 0.2)])
