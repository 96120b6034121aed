"""People do what they are asked for: they stand in doors, block the robot, and go on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.sim.people.scenes import Scene, two_rooms

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.buildings.world_file import Door
from chefbot.errors import UserError

TWO_ROOMS = (-0.1, -0.1, 8.1, 4.1)
DOOR = Door(name="door", x=4.0, y=1.55, yaw=math.pi / 2, width=0.9, kind="slide")
MIDDLE = (4.0, 2.0)


def scene(count: int, seed: int = 1) -> Scene:
    return Scene(two_rooms(0.9), TWO_ROOMS, PeopleSpec(count=count), seed, doors=[DOOR])


def distances(people: Scene) -> np.ndarray:
    return np.sort(np.hypot(*(people.people.walkers.position - MIDDLE).T))


@pytest.mark.parametrize("number", [1, 2, 4])
def test_they_stand_in_the_door_until_they_are_told_to_leave(number: int) -> None:
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
def test_what_they_cannot_do_is_said(text: str) -> None:
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
