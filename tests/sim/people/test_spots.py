"""Tests the doorways and corners that people find, and where they stand to use a door."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from tests.sim.people.scenes import room, two_rooms

from chefbot.buildings.world_file import Door
from chefbot.sim.people.floor import PeopleFloor
from chefbot.sim.people.spots import DIRECTIONS, door_sides, doorways, hiding_places
from chefbot.sim.world.doors import MovingDoor
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.shapes import clearance

TWO_ROOMS = (-0.1, -0.1, 8.1, 4.1)
CORNER = room(8.0, 6.0, [(3.0, 2.0, 3.0, 6.0), (5.0, 2.0, 5.0, 6.0)])


def floor_of(solids, bounds=TWO_ROOMS) -> PeopleFloor:
    return PeopleFloor(solids, bounds, (1.0, 1.0))


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_directions_go_all_around_in_order() -> None:
    angles = np.unwrap(np.arctan2(DIRECTIONS[:, 1], DIRECTIONS[:, 0]))
    assert np.hypot(*DIRECTIONS.T) == pytest.approx(np.ones(16))
    assert (np.diff(angles) > 0.3).all() and angles[-1] - angles[0] < 2.0 * math.pi - 0.3
    assert DIRECTIONS[8:] == pytest.approx(-DIRECTIONS[:8]), "each has an opposite"


@pytest.mark.parametrize("gap", [0.7, 0.9, 1.2])
def test_the_passage_between_two_rooms_is_a_doorway(gap: float) -> None:
    (spot,) = doorways(floor_of(two_rooms(gap)), rng(), 5)
    assert (spot.x, spot.y) == (pytest.approx(4.0, abs=0.15), pytest.approx(2.0, abs=0.1))
    assert abs(spot.ux) == pytest.approx(1.0, abs=0.12), "the passage leads along x"
    assert math.hypot(spot.ux, spot.uy) == pytest.approx(1.0)


@pytest.mark.parametrize("solids", [room(8.0, 4.0), two_rooms(0.3), two_rooms(2.2)])
def test_there_is_no_doorway_without_a_passage(solids) -> None:
    assert doorways(floor_of(solids), rng(), 5) == []


def test_a_corridor_is_not_a_doorway() -> None:
    walls = room(8.0, 4.0, [(1.0, 1.5, 7.0, 1.5), (1.0, 2.5, 7.0, 2.5)])
    for spot in doorways(floor_of(walls), rng(), 9):
        assert not 2.0 < spot.x < 6.0 or not 1.5 < spot.y < 2.5


def test_a_bounded_number_of_spots_a_metre_apart_is_found() -> None:
    walls = [(4.0, 0.0, 4.0, 0.8), (4.0, 1.7, 4.0, 3.8), (4.0, 4.7, 4.0, 6.8), (4.0, 7.7, 4.0, 9.0)]
    floor = floor_of(room(8.0, 9.0, walls), (-0.1, -0.1, 8.1, 9.1))
    spots = doorways(floor, rng(), 9)
    assert sorted(spot.y for spot in spots) == pytest.approx([1.25, 4.25, 7.25], abs=0.15)
    assert len(doorways(floor, rng(), 2)) == 2 and doorways(floor, rng(), 0) == []
    for one, other in itertools.combinations(spots, 2):
        assert math.dist(one[:2], other[:2]) > 1.0


def test_equal_seeds_find_equal_spots() -> None:
    floor = floor_of(CORNER, (-0.1, -0.1, 8.1, 6.1))
    assert hiding_places(floor, rng(3), 4) == hiding_places(floor, rng(3), 4)
    assert hiding_places(floor, rng(3), 4) != hiding_places(floor, rng(4), 4)


def test_hiding_places_are_beside_a_corner_and_lead_out() -> None:
    floor = floor_of(CORNER, (-0.1, -0.1, 8.1, 6.1))
    places = hiding_places(floor, rng(), 9)
    assert places
    for place in places:
        corner = min(math.dist(place[:2], (x, 2.0)) for x in (2.95, 3.05, 4.95, 5.05))
        assert corner < 1.0 and 0.25 <= floor.free(place.x, place.y) <= 0.51
        assert floor.is_clear(*place, PERSON_RADIUS)
        assert floor.fits(place.x, place.y)
    for one, other in itertools.combinations(places, 2):
        assert math.dist(one[:2], other[:2]) > 1.0
    assert len(hiding_places(floor, rng(), 2)) == 2


def test_corners_are_found_on_either_side() -> None:
    floor = floor_of(CORNER, (-0.1, -0.1, 8.1, 6.1))
    found = [place for seed in range(5) for place in hiding_places(floor, rng(seed), 9) if place.y > 2.2]
    for x in (3.0, 5.0):
        assert any(x - 0.7 < place.x < x for place in found) and any(x < place.x < x + 0.7 for place in found)
    for place in found:
        assert place.out_y < 2.0, "out into the corridor"
        wall = 3.0 if place.x < 4.0 else 5.0
        beyond = wall + math.copysign(2.0, wall - place.x)
        assert not floor.in_sight(place.x, place.y, beyond, 1.0)


def test_in_an_empty_room_nobody_can_hide() -> None:
    assert hiding_places(floor_of(room(8.0, 4.0)), rng(), 5) == []


@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize("swing", [math.pi / 2, -math.pi / 2])
@pytest.mark.parametrize("yaw", [math.pi / 2, -math.pi / 2])
def test_who_uses_a_door_stands_clear_of_its_leaf(kind, swing: float, yaw: float) -> None:
    hinge = 1.55 if yaw > 0.0 else 2.45
    moving = MovingDoor(Door(name="door", x=4.0, y=hinge, yaw=yaw, width=0.9, kind=kind, swing=swing))
    floor = floor_of(two_rooms(0.9))
    ((found, x, y),) = door_sides(floor, [moving])
    assert found is moving and floor.fits(x, y)
    assert math.dist((x, y), (4.0, 2.0)) < 0.65, "within reach"
    for opening in np.linspace(0.0, 1.0, 11):
        moving.open = float(opening)
        assert clearance([moving.shape], x, y, 0.0, 2.0) > PERSON_RADIUS


def test_a_door_that_is_walled_up_is_used_from_the_other_side() -> None:
    door = MovingDoor(Door(name="door", x=4.0, y=1.55, yaw=math.pi / 2, width=0.9))
    solids = two_rooms(0.9)
    ((_, x, _),) = door_sides(floor_of(solids), [door])
    behind = room(8.0, 4.0, [(x, 1.0, x, 3.0)])
    ((_, other, y),) = door_sides(floor_of([*solids, *behind]), [door])
    assert (x - 4.0) * (other - 4.0) < 0.0
    for opening in np.linspace(0.0, 1.0, 11):
        door.open = float(opening)
        assert clearance([door.shape], other, y, 0.0, 2.0) > PERSON_RADIUS
    walls = room(8.0, 4.0, [(2.4 + k, 1.0, 2.4 + k, 3.0) for k in (0.0, 0.3, 0.7, 1.0, 2.2, 2.6, 2.9)])
    assert door_sides(floor_of([*solids, *walls]), [door]) == []
