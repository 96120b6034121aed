"""Tests that people walk where they can, touch nothing, arrive, and do the same for the same seed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.sim.people.scenes import Scene, gaps_between, room, two_rooms, wall

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.buildings.world_file import Door, Route
from chefbot.errors import UserError
from chefbot.sim.people.bodies import write_poses
from chefbot.sim.people.contact import ROBOT_GAP
from chefbot.sim.people.motion import MAX_SPEED_FACTOR
from chefbot.sim.people.pinned_maths import bearing, exp_minus
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.shapes import distance

TWO_ROOMS = (-0.1, -0.1, 8.1, 4.1)
EVERYTHING = PeopleSpec(
    count=10, stand_and_talk=0.2, groups=0.2, step_out=0.1, follow=0.1, block=0.1, pull_chairs=0.1, doors=0.1
)
DOOR = Door(name="door", x=4.0, y=1.5, yaw=math.pi / 2, width=1.0, swing=-math.pi / 2)


def min_wall_gap(scene: Scene, positions: np.ndarray) -> float:
    """Return the smallest distance of a centre to the solids, m."""
    x, y = positions[..., 0].ravel(), positions[..., 1].ravel()
    return min(float(distance(solid, x, y).min()) for solid in scene.solids)


@given(st.integers(0, 10_000), st.booleans(), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
@settings(max_examples=15)
@pytest.mark.slow
def test_nobody_walks_into_anything(seed: int, avoid: bool, vx: float, vy: float) -> None:
    spec = PeopleSpec(count=10, avoid_robot=avoid, stand_and_talk=0.2, groups=0.2, follow=0.2, block=0.2)
    scene = Scene(two_rooms(), TWO_ROOMS, spec, seed, (2.0, 2.0), [DOOR])
    moved = scene.run(4.0, (vx, vy))
    still = scene.run(6.0)
    positions = np.concatenate([moved, still])
    # The field interpolates between cells of 5 cm: at the edge of a doorway it is a centimetre or two too large.
    assert min_wall_gap(scene, positions) > PERSON_RADIUS - 0.025
    assert gaps_between(positions) >= 2 * PERSON_RADIUS - 1e-6
    # Whoever the robot has not driven into does not walk into it.
    before = scene.to_robot(moved[-1])
    assert np.all(scene.to_robot(still).min(axis=0) >= np.minimum(before, ROBOT_GAP) - 1e-6)
    steps = np.diff(positions, axis=0)
    assert np.hypot(steps[..., 0], steps[..., 1]).max() <= MAX_SPEED_FACTOR * spec.fastest * 0.04 + 1e-6


@given(st.integers(0, 10_000), st.floats(1.0, 7.0), st.floats(1.0, 5.0))
@settings(max_examples=20)
def test_a_person_in_a_free_room_arrives(seed: int, x: float, y: float) -> None:
    route = Route(points=[[x, y], [8.0 - x, 6.0 - y]])
    scene = Scene(room(8.0, 6.0), (0.0, 0.0, 8.0, 6.0), PeopleSpec(count=1), seed, (0.3, 5.7), routes=[route])
    person = scene.people._persons[0]
    number = scene.people.floor.add_destination(x, y)
    person._script = _then_leave(person.travel(number), set(), 0)
    positions = scene.run(25.0)[:, 0]
    assert np.hypot(*(positions - (x, y)).T).min() < 0.36


@pytest.mark.parametrize("seed", [1, 3, 5, 7])
def test_opposing_flows_get_through_a_doorway(seed: int) -> None:
    scene = Scene(two_rooms(0.8), TWO_ROOMS, PeopleSpec(count=8), seed, (0.4, 0.4))
    people = scene.people
    left, right = people.floor.add_destination(1.0, 2.0), people.floor.add_destination(7.0, 2.0)
    crossed = set()
    for i, person in enumerate(people._persons):
        start, end = (left, right) if i % 2 == 0 else (right, left)
        scene.put(i, people.floor.destination(start)[0] + 0.15 * (i - 3), 0.9 + 0.55 * (i // 2))

        def walk(person=person, end=end):
            while not (yield from person.travel(end, within=1.5)):
                yield

        person._script = walk()
    for i, person in enumerate(people._persons):
        person._script = _then_leave(person._script, crossed, i)
    scene.run(90.0)
    assert len(crossed) == 8


def _then_leave(script, crossed, number):
    """Go on standing after the script, and note who is there."""
    yield from script
    crossed.add(number)
    while True:
        yield


def test_the_same_seed_gives_the_same_walk() -> None:
    def walk(seed: int) -> bytes:
        return Scene(two_rooms(), TWO_ROOMS, EVERYTHING, seed, doors=[DOOR]).run(10.0, (0.1, 0.05)).tobytes()

    assert walk(3) == walk(3)
    assert walk(3) != walk(4)


def test_people_react_to_the_robot_but_see_it_late() -> None:
    def walk(avoid: bool, reaction: float) -> np.ndarray:
        spec = PeopleSpec(count=1, avoid_robot=avoid, reaction_time=reaction)
        scene = Scene(room(10.0, 3.0), (0.0, 0.0, 10.0, 3.0), spec, 1, (9.0, 1.5))
        scene.put(0, 1.0, 1.5)
        number = scene.people.floor.add_destination(9.0, 1.5)
        person = scene.people._persons[0]
        person._script = _then_leave(person.travel(number), set(), 0)
        return scene.run(6.0, (-0.5, 0.0))[:, 0]

    straight, early, late = walk(False, 0.0), walk(True, 0.0), walk(True, 2.0)
    evaded = [np.argmax(np.abs(path[:, 1] - straight[:, 1]) > 0.1) for path in (early, late)]
    assert 0 < evaded[0] < evaded[1]
    assert np.abs(straight[:, 1] - 1.5).max() < 0.1


def test_who_does_not_avoid_the_robot_stops_at_it() -> None:
    spec = PeopleSpec(count=1, avoid_robot=False)
    scene = Scene(room(6.0, 1.2), (0.0, 0.0, 6.0, 1.2), spec, 1, (3.0, 0.6))
    scene.put(0, 1.0, 0.6)
    scene.people._persons[0]._script = _walk_on(scene)
    gaps = scene.to_robot(scene.run(6.0))
    assert gaps.min() >= ROBOT_GAP - 1e-9
    assert gaps[-1] < 0.06


def _walk_on(scene: Scene):
    scene.people._persons[0].approach(5.0, 0.6)
    while True:
        yield


def test_a_closed_door_is_not_walked_through() -> None:
    closed = Door(name="door", x=4.0, y=1.5, yaw=math.pi / 2, width=1.0, open=0.0)
    scene = Scene(two_rooms(1.0), TWO_ROOMS, PeopleSpec(count=6), 5, doors=[closed])
    side = scene.people.walkers.position[:, 0] > 4.0
    positions = scene.run(20.0)
    assert np.array_equal(positions[:, :, 0] > 4.0, np.broadcast_to(side, positions.shape[:2]))
    scene.doors[0].target = 1.0
    positions = scene.run(40.0)
    assert not np.array_equal(positions[-1, :, 0] > 4.0, side)


def test_people_go_round_a_box_that_is_put_down() -> None:
    scene = Scene(room(8.0, 4.0), (0.0, 0.0, 8.0, 4.0), PeopleSpec(count=6), 3)
    scene.run(2.0)
    item = wall("dropped_1", 3.5, 1.5, 4.5, 2.5)
    gap = distance(item, *scene.people.walkers.position.T)
    scene.people.add_solid(item)
    scene.solids.append(item)
    positions = scene.run(20.0)
    inside = distance(item, positions[..., 0], positions[..., 1])
    assert np.all(inside.min(axis=0) >= np.minimum(gap, PERSON_RADIUS) - 0.02)


def test_destinations_are_points_of_the_routes() -> None:
    route = Route(points=[[1.0, 1.0], [7.0, 1.0], [7.0, 5.0]], speed=0.4)
    scene = Scene(room(8.0, 6.0), (0.0, 0.0, 8.0, 6.0), PeopleSpec(count=4), 2, (4.0, 3.0), routes=[route])
    assert {scene.people.floor.destination(n) for n, _ in scene.people.route_ends} == {(1, 1), (7, 1), (7, 5)}
    assert all(pace == 0.4 for _, pace in scene.people.route_ends)


def test_people_are_placed_apart_or_rejected() -> None:
    scene = Scene(room(8.0, 6.0), (0.0, 0.0, 8.0, 6.0), PeopleSpec(count=20, groups=0.5), 1)
    positions = scene.people.walkers.position
    assert gaps_between(positions[None]) > 2 * PERSON_RADIUS + 0.3
    assert scene.to_robot(positions).min() > 0.3
    with pytest.raises(UserError, match="no room for person"):
        Scene(room(3.0, 3.0), (0.0, 0.0, 3.0, 3.0), PeopleSpec(count=30), 1)
    with pytest.raises(UserError, match="no room for person 1"):
        Scene(room(0.4, 0.4), (0.0, 0.0, 0.4, 0.4), PeopleSpec(count=1), 1, (0.2, 0.2))


@given(st.floats(0.0, 39.0))
def test_the_pinned_exponential_is_accurate(x: float) -> None:
    assert exp_minus(x) == pytest.approx(math.exp(-x), rel=1e-4, abs=1e-7)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_the_pinned_arc_tangent_is_accurate(x: float, y: float) -> None:
    difference = bearing(x, y) - math.atan2(y + 0.0, x + 0.0) if (x, y) != (0.0, 0.0) else 0.0
    assert math.remainder(difference, 2 * math.pi) == pytest.approx(0.0, abs=2e-5)


@given(st.lists(st.floats(-math.pi, math.pi), min_size=1, max_size=5))
@settings(max_examples=20)
def test_quaternions_turn_bodies_to_the_headings(yaws: list[float]) -> None:
    heading = np.array([(math.cos(yaw), math.sin(yaw)) for yaw in yaws])
    position, quaternions = np.zeros((len(yaws), 3)), np.zeros((len(yaws), 4))
    quaternions[:, 0] = 1.0
    write_poses(heading.copy(), heading, position, quaternions)
    w, z = quaternions[:, 0], quaternions[:, 3]
    assert np.column_stack([w * w - z * z, 2 * w * z]) == pytest.approx(heading, abs=1e-7)
    assert position[:, :2] == pytest.approx(heading)


def test_who_is_shut_in_walks_about_in_the_room() -> None:
    closed = Door(name="door", x=4.0, y=1.5, yaw=math.pi / 2, width=1.0, open=0.0)
    route = Route(points=[[6.0, 1.0], [7.0, 3.0]])
    scene = Scene(two_rooms(1.0), TWO_ROOMS, PeopleSpec(count=1), 1, doors=[closed], routes=[route])
    scene.people.anywhere = scene.people.route_ends
    scene.put(0, 2.0, 3.0)
    positions = scene.run(30.0)[:, 0]
    assert np.hypot(*np.diff(positions, axis=0).T).sum() > 2.0
    assert positions[:, 0].max() < 4.0 - PERSON_RADIUS
