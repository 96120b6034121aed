"""People do what is requested of them: they stand in doors, block the robot, and go on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.sim.people.scenes import Scene, aim, mode, person_of, two_rooms

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.buildings.world_file import Door
from chefbot.errors import UserError
from chefbot.sim.people.requests import AT_PLACE_DISTANCE, BLOCK_DISTANCE, PLACES
from chefbot.sim.people.walkers import APPROACH, STAND, WALK
from chefbot.sim.world.furniture import PERSON_RADIUS

TWO_ROOMS = (-0.1, -0.1, 8.1, 4.1)
DOOR = Door(name="door", x=4.0, y=1.55, yaw=math.pi / 2, width=0.9, kind="slide")
MIDDLE = (4.0, 2.0)


def scene(count: int, seed: int = 1) -> Scene:
    return Scene(two_rooms(0.9), TWO_ROOMS, PeopleSpec(count=count), seed, doors=[DOOR])


def distances(people: Scene) -> np.ndarray:
    return np.sort(np.hypot(*(people.people.walkers.position - MIDDLE).T))


@pytest.mark.parametrize("number", [1, 2, 4])
def test_they_stand_in_the_door_until_requested_to_leave(number: int) -> None:
    met = scene(5)
    met.people.request(f"meet door {number}")
    met.run(30.0)
    for _ in range(20):
        met.run(1.0)
        assert distances(met)[min(number, 2) - 1] < 0.8
        assert distances(met)[number - 1] < 1.6
    met.people.request("leave")
    nearest = np.hypot(*(met.run(20.0) - MIDDLE).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() > 0.9, "the door was free"


def test_one_who_blocks_stays_before_the_robot() -> None:
    met = scene(2)
    met.people.request("block")
    met.run(40.0)
    ahead = met.people.ahead_of_robot(0.2 + 0.22 + 0.4)
    assert min(math.dist(ahead, at) for at in met.people.walkers.position.tolist()) < 0.3
    met.people.request("leave")
    left = np.hypot(*(met.run(20.0) - ahead).transpose(2, 0, 1)).min(axis=1)
    assert left.max() > 0.5


@pytest.mark.parametrize(
    "text", ["", "meet", "meet door", "meet door 9", "meet hatch 1", "meet door x", "dance"]
)
def test_impossible_requests_are_reported(text: str) -> None:
    with pytest.raises(UserError):
        scene(2).people.request(text)


def test_equal_requests_give_equal_walks() -> None:
    walks = []
    for _ in range(2):
        met = scene(3, 5)
        met.run(2.0)
        met.people.request("meet door 2")
        met.run(10.0)
        met.people.request("leave")
        met.run(3.0)
        walks.append(met.people.walkers.position.copy())
    assert np.array_equal(*walks)


def test_the_nearest_to_a_door_are_met_there() -> None:
    one = scene(3)
    for number, x in enumerate((1.0, 3.0, 7.5)):
        one.put(number, x, 2.0)
    one.people.request("meet door 2")
    assert [person.number for person in one.people._requests._met] == [1, 0]
    for person in one.people._persons:
        person.decide()
    assert mode(one, 1) == APPROACH, "it is near already"
    offset = math.dist(aim(one, 1), (4.0, 2.0))
    assert offset == pytest.approx(math.hypot(*PLACES[0]))
    assert mode(one, 0) == WALK


def test_who_is_at_its_place_stands_and_looks_at_the_middle() -> None:
    one = scene(1)
    one.put(0, 4.0, 2.0)
    one.people.request("meet door 1")
    person_of(one).decide()
    place = aim(one)
    one.put(0, place[0] + 0.9 * AT_PLACE_DISTANCE, place[1])
    person_of(one).decide()
    person_of(one).decide()
    assert mode(one) == STAND and aim(one) == pytest.approx((4.0, 2.0))


def test_only_people_who_were_met_are_requested_to_leave() -> None:
    one = scene(3)
    one.people.request("meet door 1")
    (met,) = one.people._requests._met
    scripts = {person.number: person._script for person in one.people._persons}
    one.people.request("leave")
    changed = [number for number, script in scripts.items() if person_of(one, number)._script is not script]
    assert changed == [met.number] and one.people._requests._met == []
    one.people.request("leave")


def test_who_blocks_is_the_nearest_or_who_was_met() -> None:
    one = scene(3)
    for number, x in enumerate((7.0, 1.5, 3.0)):
        one.put(number, x, 1.0)
    one.people.request("block")
    assert [person.number for person in one.people._requests._met] == [1]
    one.people.request("meet door 2")
    met = list(one.people._requests._met)
    one.people.request("block")
    assert one.people._requests._met == met


def test_a_blocker_stands_before_the_robots_front() -> None:
    one = scene(1)
    one.put(0, 2.0, 2.0)
    one.people.sees_robot = lambda _: True  # type: ignore[method-assign]
    one.people.request("block")
    person_of(one).decide()
    ahead = one.robot.radius + PERSON_RADIUS + BLOCK_DISTANCE
    assert aim(one) == pytest.approx((one.robot.x + ahead, one.robot.y))
    one.put(0, one.robot.x + ahead, one.robot.y)
    person_of(one).decide()
    assert mode(one) == STAND and not one.people.walkers.shy[0]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("meet hatch 1", "the world has no door 'hatch'"),
        ("meet door 0", "0 people cannot meet: there are 2"),
        ("meet door 3", "3 people cannot meet: there are 2"),
        ("block now", "people have no request 'block now'"),
        ("meet door -1", "use 'meet DOOR NUMBER'"),
    ],
)
def test_what_cannot_be_done_changes_nothing(text: str, sentence: str) -> None:
    one = scene(2)
    one.people.request("meet door 1")
    met, scripts = one.people._requests._met, [person._script for person in one.people._persons]
    with pytest.raises(UserError, match=sentence):
        one.people.request(text)
    assert one.people._requests._met is met
    assert [person._script for person in one.people._persons] == scripts


def test_a_door_has_one_destination_however_often_it_is_named() -> None:
    one = scene(2)
    before = len(one.people.floor._destinations)
    for _ in range(5):
        one.people.request("meet door 1")
    assert len(one.people.floor._destinations) == before + 1
