"""Tests what moves in a world besides the robot: its order among the bodies, its poses in MuJoCo, and its shapes."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.buildings.world_file import Door
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.sim.movers import Movers
from chefbot.sim.people.people import RobotCircle
from chefbot.sim.world.shapes import box, shape_arrays
from chefbot.sim.world.world import load_world

DOOR = Door(name="hatch", x=1.0, y=1.5, yaw=0.0, width=0.8, swing=-math.pi / 2, open=0.0)
SLIDE = Door(name="slide", x=-0.5, y=0.9, yaw=0.0, width=0.8, kind="slide", open=1.0)
ROOM = load_world("room")
WORLD = dataclasses.replace(ROOM, doors=(DOOR, SLIDE))
AWAY = RobotCircle(0.0, -0.5, 1.0, 0.0, 0.2)
PERIOD = 0.04


def movers(spec: PeopleSpec | None = None, seed: int = 1) -> Movers:
    return Movers(WORLD, spec or PeopleSpec(), AWAY, np.random.default_rng(seed))


def physics(count: int) -> Any:
    """Return the arrays of MuJoCo's data for so many bodies."""
    return SimpleNamespace(
        mocap_pos=np.zeros((count, 3)), mocap_quat=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    )


def poses_in(data: Any) -> np.ndarray:
    """Return x, y and yaw of all bodies."""
    yaw = 2.0 * np.arctan2(data.mocap_quat[:, 3], data.mocap_quat[:, 0])
    assert np.allclose((data.mocap_quat**2).sum(axis=1), 1.0)
    return np.column_stack([data.mocap_pos[:, :2], np.cos(yaw), np.sin(yaw)])


def poses_of(one: Movers) -> np.ndarray:
    poses = [body.pose for body in one.mocap_bodies()]
    return np.array([(x, y, math.cos(yaw), math.sin(yaw)) for x, y, yaw in poses]).reshape(-1, 4)


CHAIRS_AND_PEOPLE = PeopleSpec(count=3, pull_chairs=0.4)


def test_doors_then_chairs_then_people_are_the_bodies() -> None:
    names = [body.name for body in movers(CHAIRS_AND_PEOPLE).mocap_bodies()]
    assert names[:2] == ["hatch", "slide"] and names[-3:] == ["person_0", "person_1", "person_2"]
    chairs = names[2:-3]
    assert chairs and all("chair" in name for name in chairs)


def test_bodies_are_written_where_they_are() -> None:
    one = movers(CHAIRS_AND_PEOPLE)
    data = physics(len(one.mocap_bodies()))
    one.write(data)
    assert poses_in(data) == pytest.approx(poses_of(one), abs=1e-6)
    one.doors["hatch"].target = 1.0
    one._people.movable[0].target = 0.3  # type: ignore[union-attr]
    before = poses_of(one)
    for _ in range(40):
        one.advance(PERIOD, AWAY, data)
    assert poses_in(data) == pytest.approx(poses_of(one), abs=1e-6)
    moved = np.abs(poses_of(one) - before).max(axis=1) > 0.01
    assert moved[0] and not moved[1] and moved[2] and moved[-3:].all()


def test_shapes_are_where_the_bodies_are() -> None:
    one = movers(CHAIRS_AND_PEOPLE)
    data = physics(len(one.mocap_bodies()))
    for _ in range(20):
        one.doors["hatch"].target = 1.0
        one.advance(PERIOD, AWAY, data)
        expected = shape_arrays(
            [shape.transformed(body.pose) for body in one.mocap_bodies() for shape in body.shapes]
        )
        found = one.shapes()
        assert np.array_equal(found.kind, expected.kind) and np.array_equal(found.half, expected.half)
        assert found.centre == pytest.approx(expected.centre, abs=1e-9)
    names = [shape.name.split("/")[0] for shape in one.doors_and_chairs()]
    assert names[:2] == ["hatch", "slide"] and all("chair" in name for name in names[2:])


def test_chairs_that_people_use_are_no_longer_fixed() -> None:
    one = movers(CHAIRS_AND_PEOPLE)
    used = {solid for chair in one._people.movable for solid in chair.solids}  # type: ignore[union-attr]
    assert used and not used & set(one.fixed)
    assert used | set(one.fixed) == set(WORLD.static)
    assert movers(PeopleSpec(count=2)).fixed == movers().fixed == WORLD.static


def test_a_door_waits_for_the_robot() -> None:
    one, data = movers(), physics(2)
    door = one.doors["slide"]
    door.target = 0.0
    in_the_way = RobotCircle(-0.1, 0.9, 1.0, 0.0, 0.2)
    for _ in range(100):
        one.advance(PERIOD, in_the_way, data)
    assert 0.1 < door.open < 1.0 and door.moving
    for _ in range(100):
        one.advance(PERIOD, AWAY, data)
    assert door.open == 0.0


def test_what_rests_is_not_written_again() -> None:
    one, data = movers(), physics(2)
    one.write(data)
    data.mocap_pos[:] = 7.0
    one.advance(PERIOD, AWAY, data)
    assert (data.mocap_pos == 7.0).all()
    assert one.people_poses() == one.people_circles() == []


def test_requests_need_people() -> None:
    with pytest.raises(UserError, match="no people in this world"):
        movers().request("block")
    movers(PeopleSpec(count=1)).request("block")
    movers().add_solid(box("crate", SE2(1.0, 0.0, 0.0), 0.0, (0.3, 0.3, 0.3), (9, 9, 9)))


def test_people_see_a_solid_that_is_put_down() -> None:
    one = movers(PeopleSpec(count=1))
    x, y = 1.2, 0.2
    assert one._people is not None and one._people.floor.free(x, y) > 0.3
    one.add_solid(box("crate", SE2(x, y, 0.0), 0.0, (0.3, 0.3, 0.5), (9, 9, 9)))
    assert one._people.floor.free(x, y) == pytest.approx(0.0, abs=0.03)


def test_equal_seeds_place_and_walk_people_alike() -> None:
    def walk(seed: int) -> np.ndarray:
        one = movers(PeopleSpec(count=3), seed)
        data = physics(5)
        for _ in range(30):
            one.advance(PERIOD, AWAY, data)
        return poses_of(one)

    assert np.array_equal(walk(4), walk(4))
    assert not np.array_equal(walk(4), walk(5))
