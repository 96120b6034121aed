"""Tests the scripts of simulated people step by step: what each waits for, and where it goes in the meantime."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.sim.people.scenes import (
    DECISION,
    Scene,
    Script,
    aim,
    chair,
    decide,
    drive,
    mode,
    person_of,
    room,
    two_rooms,
)

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.buildings.world_file import Door, Route
from chefbot.sim.people.chairs import TRAVEL
from chefbot.sim.people.kinds import (
    BLOCK_TIME,
    FOLLOW_DISTANCE,
    Blocker,
    Companion,
    Follower,
    PullsChairs,
    Talker,
    UsesDoors,
)
from chefbot.sim.people.person import ARRIVAL_DISTANCE, MIN_ROUTE_LENGTH, SimulatedPerson
from chefbot.sim.people.walkers import APPROACH, STAND, WALK
from chefbot.sim.world.furniture import PERSON_RADIUS

BOUNDS = (0.0, 0.0, 6.0, 6.0)
TWO_ROOMS = (-0.1, -0.1, 8.1, 4.1)
DOOR = Door(name="door", x=4.0, y=1.55, yaw=math.pi / 2, width=0.9, kind="slide")


def scene(count: int = 1, **kinds: float) -> Scene:
    return Scene(room(6.0, 6.0), BOUNDS, PeopleSpec(count=count, **kinds), 1, (5.5, 5.5))


# What scripts are made of


@pytest.mark.parametrize("seconds", [0.0, 0.3, 2.0])
def test_a_pause_takes_its_time(seconds: float) -> None:
    one, begin = scene(), 0.0
    drive(one, person_of(one).pause(seconds))
    assert seconds <= one.people.now - begin <= seconds + 2.0 * DECISION


def test_who_comes_near_enough_has_come() -> None:
    one = scene()
    one.put(0, 1.0, 1.0)
    script = person_of(one).come_to(3.0, 1.0, 0.2, 10.0, pace=0.7)
    decide(one, script)
    assert mode(one) == APPROACH and aim(one) == (3.0, 1.0) and one.people.walkers.pace[0] == 0.7
    one.put(0, 2.9, 1.0)
    assert drive(one, script) is True
    assert mode(one) == STAND


def test_who_does_not_come_gives_up_after_the_time() -> None:
    one = scene()
    one.put(0, 1.0, 1.0)
    assert drive(one, person_of(one).come_to(3.0, 1.0, 0.2, 4.0)) is False
    assert one.people.now == pytest.approx(4.0, abs=2 * DECISION) and mode(one) == STAND


def test_a_destination_is_reached_within_the_given_distance() -> None:
    one = scene()
    one.put(0, 1.0, 1.0)
    number = one.people.floor.add_destination(4.0, 4.0)
    script = person_of(one).travel(number, pace=0.5, within=1.0)
    decide(one, script)
    assert mode(one) == WALK and one.people.walkers.destination[0] == number
    assert one.people.walkers.pace[0] == 0.5
    one.put(0, 4.0, 4.9)
    assert drive(one, script) is True and mode(one) == STAND


def test_who_is_stuck_makes_way_three_times_and_gives_up() -> None:
    one, aside = scene(), list[tuple[float, float]]()
    one.put(0, 3.0, 3.0)
    number = one.people.floor.add_destination(5.0, 1.0)

    def stay() -> None:
        if mode(one) == APPROACH and (not aside or aside[-1] != aim(one)):
            aside.append(aim(one))
        one.people.walkers.stuck[0] = 9.0 if mode(one) == WALK else 0.0

    assert drive(one, person_of(one).travel(number), stay) is False
    assert len(aside) == 3 and mode(one) == STAND
    for x, y in aside:
        assert 0.5 < math.dist((x, y), (3.0, 3.0)) < 1.5, "a step or two"


def test_what_cannot_be_reached_is_not_tried() -> None:
    one = scene()
    number = one.people.floor.add_destination(20.0, 20.0)
    assert drive(one, person_of(one).travel(number)) is False
    assert one.people.now == DECISION


def test_aside_is_where_there_is_room() -> None:
    one = scene(3)
    one.put(0, 1.0, 3.0)
    one.put(1, 1.6, 3.8)
    one.put(2, 1.6, 2.2)
    away = [person_of(one)._roomiest_point() for _ in range(20)]
    rooms = [
        min(x, 6 - x, y, 6 - y, *(math.dist((x, y), p) for p in ((1.6, 3.8), (1.6, 2.2)))) for x, y in away
    ]
    assert np.median(rooms) > 0.5
    for x, y in away:
        assert one.people.floor.is_clear(1.0, 3.0, x, y, PERSON_RADIUS)


def test_nobody_steps_aside_through_a_wall() -> None:
    one = Scene(two_rooms(), TWO_ROOMS, PeopleSpec(count=1), 1, (7.0, 3.0))
    one.put(0, 3.65, 1.0)
    assert all(person_of(one)._roomiest_point()[0] < 4.0 for _ in range(30))


def test_destinations_are_far_if_there_are_such() -> None:
    route = Route(points=[[1.0, 1.0], [5.0, 1.0]], speed=0.3)
    one = Scene(room(6.0, 6.0), BOUNDS, PeopleSpec(count=1), 1, (5.5, 5.5), routes=[route])
    one.put(0, 1.1, 1.0)
    person, drawn = person_of(one), list[tuple[Any, float]]()
    for _ in range(60):
        drawn.append(person._draw_destination())
    on_route = {number for number, _ in one.people.route_ends}
    lengths = [one.people.floor.path_length(number, 1.1, 1.0) for number, _ in drawn]
    assert min(lengths) > ARRIVAL_DISTANCE and sum(length > MIN_ROUTE_LENGTH for length in lengths) >= 57, (
        "but for bad luck"
    )
    assert all(pace == (0.3 if number in on_route else person.pace) for number, pace in drawn)
    share = sum(number in on_route for number, _ in drawn) / 60
    assert 0.3 < share < 0.95, "most, but not all, lie on routes"


def test_in_a_small_room_a_near_destination_will_do() -> None:
    one = Scene(room(2.2, 2.2), (0.0, 0.0, 2.2, 2.2), PeopleSpec(count=1), 1, (1.8, 1.8))
    one.put(0, 0.6, 0.6)
    for _ in range(20):
        number, _ = person_of(one)._draw_destination()
        assert (
            number is None
            or ARRIVAL_DISTANCE < one.people.floor.path_length(number, 0.6, 0.6) <= MIN_ROUTE_LENGTH
        )


def test_an_interruption_ends_what_somebody_is_at() -> None:
    one, ended = scene(), list[str]()

    def busy() -> Script:
        try:
            while True:
                yield
        finally:
            ended.append("busy")

    def requested() -> Script:
        ended.append("requested")
        yield

    person = person_of(one)
    person._script = busy()
    person.decide()
    one.people.walkers.shy[0] = False
    person.approach(1.0, 1.0)
    person.interrupt(requested())
    assert ended == ["busy"] and mode(one) == STAND and one.people.walkers.shy[0]
    person.decide()
    assert ended == ["busy", "requested"]
    person.decide()
    assert mode(one) in (WALK, APPROACH), "then the person goes on as before"


def test_standing_people_look_in_the_scripted_direction() -> None:
    one = scene()
    one.put(0, 2.0, 2.0)
    one.people.walkers.heading[0] = (0.0, 1.0)
    person_of(one).stand()
    assert aim(one) == (2.0, 3.0)
    person_of(one).stand((5.0, 2.0))
    assert aim(one) == (5.0, 2.0)


# Kinds


def test_the_first_of_a_pair_invites_the_other() -> None:
    one = Scene(two_rooms(1.0), TWO_ROOMS, PeopleSpec(count=2, stand_and_talk=1.0), 1)
    first, second = person_of(one), person_of(one, 1)
    assert isinstance(first, Talker) and first.partner is second and second.partner is first
    first.decide()
    assert first.meeting is not None and second.meeting == first.meeting
    place = first.meeting
    one.put(0, place.x + 0.5, place.y)
    one.put(1, place.x - 0.5, place.y)
    second._script = second._talk(place, -1.0)
    decide(one, second._script, 2)
    assert mode(one, 1) == APPROACH
    x, y = aim(one, 1)
    first._script = first._talk(place, 1.0)
    decide(one, first._script, 2)
    assert (x + aim(one)[0], y + aim(one)[1]) == pytest.approx((2 * place.x, 2 * place.y)), "face to face"
    assert drive(one, second._script) is None and second.meeting is None


def test_a_companion_does_what_its_leader_does() -> None:
    one = scene(2, groups=1.0)
    leader, companion = person_of(one), person_of(one, 1)
    assert isinstance(companion, Companion) and companion.leader is leader
    assert one.people.walkers.group.tolist() == [0, 0]
    number, w = one.people.floor.add_destination(5.0, 1.0), one.people.walkers
    leader._set_out(number, 0.8)
    companion.decide()
    assert (w.mode[1], w.destination[1], w.pace[1]) == (WALK, number, 0.8)
    assert np.array_equal(w.aim[1], w.aim[0])
    leader.stand()
    one.put(0, 3.0, 3.0)
    one.put(1, 1.0, 3.0)
    companion.decide()
    assert mode(one, 1) == APPROACH and aim(one, 1) == (3.0, 3.0), "it comes up"
    one.put(1, 2.2, 3.0)
    companion.decide()
    assert mode(one, 1) == STAND and aim(one, 1) == (3.0, 3.0)


def test_a_follower_leaves_some_room_behind_the_robot() -> None:
    one = scene(1, follow=1.0)
    person = person_of(one)
    assert isinstance(person, Follower)
    one.put(0, 1.0, 1.0)
    one.drive(4.0, 1.0)
    one.people._see(one.robot)
    one.people._see(one.robot)
    one.people.now += 1.0
    one.people._see(one.robot)
    assert one.people.sees_robot(0)
    script = person._follow()
    decide(one, script)
    keep = one.robot.radius + PERSON_RADIUS + FOLLOW_DISTANCE
    assert mode(one) == APPROACH and aim(one) == pytest.approx((4.0 - keep, 1.0))
    assert not one.people.walkers.shy[0], "it does not avoid the robot"
    one.put(0, 4.0 - keep, 1.0)
    decide(one, script)
    assert mode(one) == STAND and aim(one) == (4.0, 1.0)
    one.people.sees_robot = lambda _: False  # type: ignore[method-assign]
    decide(one, script)
    assert mode(one) == APPROACH and aim(one) == (4.0, 1.0), "to where it was seen last"
    drive(one, script)
    assert one.people.walkers.shy[0]


def test_who_blocks_the_robot_leaves_it_alone_after_a_while() -> None:
    one = scene(1, block=1.0)
    person = person_of(one)
    assert isinstance(person, Blocker)
    one.people.sees_robot = lambda _: True  # type: ignore[method-assign]
    drive(one, person._block())
    assert BLOCK_TIME[0] <= one.people.now <= BLOCK_TIME[1] + DECISION
    assert one.people.walkers.shy[0]


def test_a_chair_is_free_again_after_an_interruption() -> None:
    spec = PeopleSpec(count=1, pull_chairs=1.0)
    one = Scene([*room(6.0, 5.0), *chair(4.0, 2.5, 0.0)], (0.0, 0.0, 6.0, 5.0), spec, 1)
    (task,), person = one.people.chairs, person_of(one)
    assert isinstance(person, PullsChairs)
    script = person._use(task)
    decide(one, script)
    assert task.user == 0
    script.close()
    assert task.user is None and task.chair.target == 0.0


def test_a_chair_is_pulled_by_who_stands_behind_it() -> None:
    spec = PeopleSpec(count=1, pull_chairs=1.0)
    one = Scene([*room(6.0, 5.0), *chair(4.0, 2.5, 0.0)], (0.0, 0.0, 6.0, 5.0), spec, 1)
    (task,), person = one.people.chairs, person_of(one)
    one.put(0, *task.chair.behind(0.0))
    targets = list[float]()

    def pull() -> None:
        targets.append(task.chair.target)
        task.chair.out = task.chair.target
        one.put(0, *task.chair.behind(task.chair.out))

    drive(one, person._use(task), pull)
    assert targets[0] == 0.0 and TRAVEL in targets and task.chair.out == TRAVEL
    drive(one, person._use(task), pull)
    assert task.chair.out == 0.0, "the next time it is pushed in"


def test_who_uses_doors_changes_what_it_finds() -> None:
    spec = PeopleSpec(count=1, doors=1.0)
    one = Scene(two_rooms(0.9), TWO_ROOMS, spec, 1, doors=[DOOR])
    person, (door,) = person_of(one), one.doors
    assert isinstance(person, UsesDoors)
    ((_, number),) = one.people.door_sides
    one.put(0, *one.people.floor.destination(number))
    person.decide()
    person.decide()
    assert door.target == 0.0 and mode(one) == STAND
    door.open = 0.0
    person._script = person.steps()
    person.decide()
    person.decide()
    assert door.target == 1.0


def test_all_who_only_walk_are_plain_people() -> None:
    assert all(type(person) is SimulatedPerson for person in scene(3).people._persons)
