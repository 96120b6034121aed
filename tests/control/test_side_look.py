"""Looks to the sides: when they are needed, what they show, and that they end."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.people_cost import NOBODY, NearbyPeople
from chefbot.control.side_look import (
    HIDDEN_TIME,
    MAX_TIME,
    PEOPLE_MEMORY,
    RETURN_TOLERANCE,
    SIDE_BEARING,
    SideLook,
    SideView,
)
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

HALF_VIEW, PERIOD = math.radians(29.0), 0.1
BEAMS = np.linspace(-HALF_VIEW, HALF_VIEW, 100)
FAR = NearbyPeople(np.array([[5.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0]]), 0.4)
YAW = st.floats(-math.pi, math.pi)


def person(bearing: float, distance: float, yaw: float = 0.0) -> NearbyPeople:
    """Return somebody who stands at a bearing (degrees) of a robot with this yaw at the origin."""
    direction = yaw + math.radians(bearing)
    x, y = distance * math.cos(direction), distance * math.sin(direction)
    return NearbyPeople(np.array([[x, y, 0.0, 0.0, 0.01, 0.0, 0.0]]), 0.4)


class Robot:
    """A robot at a place that turns as commanded; it sees all directions but those between the two of `hidden`."""

    def __init__(self, yaw: float = 0.0, hidden: tuple[float, float] | None = None) -> None:
        self.look = SideLook(HALF_VIEW, Limits.of(load_robot("chefbot")), PERIOD)
        self.pose, self.time, self.hidden = SE2(0.0, 0.0, yaw), 100.0, hidden
        self.yaws: list[float] = []
        self.hidden_steps = 0

    @property
    def now_ns(self) -> int:
        return round(self.time * 1e9)

    def see(self) -> None:
        directions = self.pose.yaw + BEAMS
        has_data = np.ones(len(BEAMS), np.bool_)
        if self.hidden is not None:
            low, high = self.hidden
            has_data = np.array([not 0.0 <= wrap(one - low) <= high - low for one in directions])
        self.look.seen.process(self.pose, directions, has_data, self.now_ns)

    def turn(self, w: float) -> None:
        self.pose = SE2(self.pose.x, self.pose.y, wrap(self.pose.yaw + w * PERIOD))
        self.time += PERIOD
        self.yaws.append(self.pose.yaw)
        self.see()

    def step(self, people: NearbyPeople, speed: float = 0.0, wanted: float = 0.3) -> SideView | None:
        if len(people.states):
            self.look.note_people(self.now_ns)
        return self.look.step(self.pose, wanted, speed, people, self.now_ns)

    def drive_off(self, people: NearbyPeople = FAR, seconds: float = 30.0) -> float:
        """Return the time until the robot may drive forward."""
        began = self.time
        while (view := self.step(people)) is not None:
            self.hidden_steps += view.hidden
            self.turn(view.w)
            assert self.time - began < seconds, "the look does not end"
        return self.time - began


def drives() -> Robot:
    """Return a robot at the origin that has driven there."""
    robot = Robot()
    robot.pose = SE2(-0.3, 0.0, 0.0)
    robot.see()
    robot.step(NOBODY, speed=0.3)
    robot.pose = SE2(0.0, 0.0, 0.0)
    robot.see()
    robot.step(NOBODY, speed=0.3)
    return robot


@given(YAW)
def test_it_looks_to_both_sides_and_comes_back(yaw: float) -> None:
    robot = Robot(yaw)
    robot.see()
    assert robot.drive_off() < 8.0
    offsets = [wrap(one - yaw) for one in robot.yaws]
    assert min(offsets) < -(SIDE_BEARING - HALF_VIEW) + 0.2
    assert max(offsets) > SIDE_BEARING - HALF_VIEW - 0.2
    assert abs(offsets[-1]) <= RETURN_TOLERANCE


@given(YAW, YAW, st.floats(0.05, 2.0), st.sampled_from([-80.0, -45.0, 0.0, 45.0, 80.0]))
def test_it_ends_whatever_is_hidden(yaw: float, low: float, width: float, bearing: float) -> None:
    robot = Robot(yaw, (low, low + width))
    robot.see()
    assert robot.drive_off(person(bearing, 0.6, yaw)) < MAX_TIME + 3.0
    assert abs(wrap(robot.pose.yaw - yaw)) <= RETURN_TOLERANCE


def test_without_people_about_it_drives() -> None:
    robot = Robot()
    assert robot.step(NOBODY) is None


def test_people_of_a_while_ago_are_gone() -> None:
    robot = Robot()
    assert robot.step(FAR, wanted=0.0) is None
    robot.time += PEOPLE_MEMORY + 1.0
    assert robot.step(NOBODY) is None


@pytest.mark.parametrize(("speed", "looks"), [(0.3, False), (0.08, True)])
def test_a_robot_that_drives_on_has_seen_its_sides(speed: float, looks: bool) -> None:
    """A robot that creeps does not see its sides soon enough."""
    robot = Robot()
    robot.drive_off()
    looked = False
    for _ in range(60):
        robot.pose = SE2(robot.pose.x + speed * PERIOD, 0.0, 0.0)
        robot.time += PERIOD
        robot.see()
        looked = looked or robot.step(FAR, speed=speed) is not None
    assert looked is looks


@pytest.mark.parametrize("turn", [-1.0, 1.0])
def test_after_a_turn_it_looks_to_the_other_side_only(turn: float) -> None:
    """What the view has just passed over is seen; the robot has driven until now."""
    robot = Robot()
    robot.drive_off()
    for _ in range(15):
        robot.turn(turn)
    heading = robot.pose.yaw
    robot.yaws.clear()
    robot.drive_off()
    assert len(robot.yaws)
    assert all(turn * wrap(one - heading) > -RETURN_TOLERANCE for one in robot.yaws)


@pytest.mark.parametrize("bearing", [-60.0, -40.0, 40.0, 60.0])
def test_it_looks_after_a_person_who_left_its_view(bearing: float) -> None:
    robot = drives()
    somebody = person(bearing, 0.7)
    view = robot.step(somebody, speed=0.3)
    assert view == SideView(0.0), "it brakes before it turns"
    robot.drive_off(somebody)
    seen = [abs(wrap(math.radians(bearing) - yaw)) < HALF_VIEW for yaw in robot.yaws]
    assert any(seen)
    assert all(yaw * bearing > -RETURN_TOLERANCE for yaw in robot.yaws)


@pytest.mark.parametrize(("bearing", "distance"), [(60.0, 2.0), (150.0, 0.6), (10.0, 0.6)])
def test_it_drives_past_who_is_far_behind_or_in_view(bearing: float, distance: float) -> None:
    robot = drives()
    assert robot.step(person(bearing, distance), speed=0.3) is None


def test_an_uncertain_person_may_be_near() -> None:
    robot = drives()
    somebody = person(-60.0, 1.2)
    somebody.states[0, 4] = 1.0
    assert robot.step(somebody, speed=0.3) is not None


@pytest.mark.parametrize(("deviation", "looks"), [(0.02, False), (0.3, True)])
def test_a_person_may_be_beyond_the_edge_of_the_view(deviation: float, looks: bool) -> None:
    robot = drives()
    somebody = person(20.0, 0.7)
    somebody.states[0, 4] = deviation**2
    assert (robot.step(somebody, speed=0.3) is not None) is looks


def test_it_waits_for_what_is_hidden_beside_it() -> None:
    robot = Robot(hidden=(math.radians(35.0), math.radians(60.0)))
    robot.see()
    robot.drive_off()
    assert robot.hidden_steps * PERIOD == pytest.approx(HIDDEN_TIME, abs=0.2)


def test_a_look_is_not_repeated_at_once() -> None:
    robot = Robot(hidden=(math.radians(35.0), math.radians(60.0)))
    robot.see()
    robot.drive_off()
    assert robot.step(person(45.0, 0.6)) is None


def test_from_another_place_it_has_seen_nothing() -> None:
    robot = Robot()
    robot.see()
    since_ns = robot.now_ns
    assert len(robot.look.seen.not_seen_since(since_ns, -0.3, 0.3)) == 0
    robot.pose = SE2(0.2, 0.0, math.pi)
    robot.see()
    assert len(robot.look.seen.not_seen_since(since_ns, -0.3, 0.3)) > 0
