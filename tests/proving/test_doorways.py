"""The measurements of a robot at a blocked door: delays of requests and passage, and where it waits."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from chefbot.buildings.world_file import Door
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, Twist, TwistWithCovariance
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import String
from chefbot.proving.doorways import HELD_UP_TIME, SPEECH, DoorwayObserver
from chefbot.robot.load import load_robot
from chefbot.runtime.loop import Publication

ROBOT = load_robot("chefbot_lidar")
DOOR = Door(name="door", x=0.0, y=-0.5, yaw=math.pi / 2, width=1.0)
"""Its middle is at (0, 0); the robot goes through it along -x or x."""
PERIOD, PATIENCE = 0.1, 300.0


class Passage:
    """A robot that moves towards a door as the test commands, 10 ground truths a second; the goal is at x > 0."""

    def __init__(self, blocks: bool = True, doors: tuple[Door, ...] = (DOOR,), begin: float = 100.0) -> None:
        self.opening, self.people = 1.0, list[SE2]()
        simulation = SimpleNamespace(people=self.people, doors=lambda: {"door": self.opening})
        self.run: Any = SimpleNamespace(
            time=begin,
            world=SimpleNamespace(doors=doors),
            safety=SimpleNamespace(simulation=simulation),
            system=SimpleNamespace(robot=ROBOT),
        )
        middle_x_axis = DoorwayObserver(self.run, DOOR, 1.0)._middle.between(SE2(1.0, 0.0, 0.0)).x
        self.observer = DoorwayObserver(self.run, DOOR, math.copysign(1.0, middle_x_axis))
        self.observer.blocks = blocks
        self.x = -2.0
        self.publish("navigation_status", NavigationStatus(state="driving"))

    def publish(self, topic: str, message: Message) -> None:
        self.observer(Publication(topic, message, "test", False, round(self.run.time * 1e9), False))

    def step(self, v: float, w: float = 0.0, y: float = 0.0) -> None:
        self.run.time = round(self.run.time + PERIOD, 6)
        self.x += v * PERIOD
        pose = PoseWithCovariance(pose=Pose.of(SE2(self.x, y, 0.0)))
        self.publish("ground_truth", Odometry(pose=pose, twist=TwistWithCovariance(twist=Twist.of(v, w))))

    def drive_to(self, x: float) -> None:
        while self.x < x - 1e-9:
            self.step(0.5)

    def stand(self, seconds: float, w: float = 0.0, y: float = 0.0) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.step(0.0, w, y)

    def figures(self, reached: bool = True) -> dict[str, float]:
        return self.observer.figures(reached, PATIENCE)


def blocked() -> Passage:
    """A robot that stands before two people in the door."""
    passage = Passage()
    passage.people += [SE2(0.0, 0.3, 0.0), SE2(0.0, -0.3, 0.0)]
    passage.drive_to(-1.0)
    return passage


def test_the_first_request_is_timed_from_when_the_robot_stands() -> None:
    passage = blocked()
    passage.stand(4.0)
    passage.publish(SPEECH, String("may I pass?"))
    passage.stand(3.0)
    passage.publish(SPEECH, String("may I pass?"))
    assert passage.figures()["request_delay"] == pytest.approx(4.0, abs=2 * PERIOD)


def test_a_request_before_the_robot_stands_is_not_a_delay() -> None:
    passage = blocked()
    passage.publish(SPEECH, String("may I pass?"))
    passage.stand(5.0)
    assert passage.figures()["request_delay"] == 0.0


def test_without_any_request_there_is_no_figure() -> None:
    passage = blocked()
    passage.stand(5.0)
    assert "request_delay" not in passage.figures()


def test_a_robot_that_was_not_held_up_has_no_delay() -> None:
    passage = Passage()
    passage.drive_to(1.0)
    assert passage.figures() == {
        "given_up": 0.0, "doorway_share": 0.0, "request_delay": 0.0, "passage_delay": 0.0
    }  # fmt: skip


@pytest.mark.parametrize(
    ("what", "held_up"),
    [
        ("people", True),
        ("closed", True),
        ("nothing", False),
        ("far", False),
        ("not blocking", False),
        ("idle", False),
    ],
)
def test_a_robot_is_held_up_by_a_door_that_is_not_free(what: str, held_up: bool) -> None:
    passage = Passage(blocks=what != "not blocking")
    passage.people += [] if what in ("closed", "nothing") else [SE2(0.0, 0.3, 0.0)]
    passage.opening = 0.5 if what == "closed" else 1.0
    if what == "idle":
        passage.publish("navigation_status", NavigationStatus(state="idle"))
    passage.x = -7.0 if what == "far" else -1.0
    passage.stand(3.0)
    assert (passage.observer.held_up_at < math.inf) == held_up
    if held_up:
        assert passage.observer.held_up_at == pytest.approx(100.0, abs=2 * PERIOD)


def test_who_stands_before_the_robot_holds_it_up_anywhere_near() -> None:
    for ahead, held_up in ((1.0, True), (1.5, False), (-1.0, False)):
        passage = Passage()
        passage.x = -4.0
        passage.people.append(SE2(-4.0 + ahead, 0.0, 0.0))
        passage.stand(3.0)
        assert (passage.observer.held_up_at < math.inf) == held_up


def test_pauses_and_turns_are_not_waiting() -> None:
    passage = blocked()
    for _ in range(5):
        passage.stand(0.8 * HELD_UP_TIME)
        passage.step(0.3)
    passage.stand(5.0, w=0.5)
    assert passage.observer.held_up_at == math.inf
    assert passage.figures()["doorway_share"] == 0.0


def test_the_passage_delay_counts_from_when_the_door_is_free() -> None:
    passage = blocked()
    passage.stand(10.0)
    passage.observer.released = True
    passage.stand(3.0)
    passage.people.clear()
    passage.stand(2.0)
    passage.drive_to(0.6)
    expected = 2.0 + 1.6 / 0.5
    assert passage.figures()["passage_delay"] == pytest.approx(expected, abs=0.4)
    passage.stand(5.0)
    assert passage.figures()["passage_delay"] == pytest.approx(expected, abs=0.4), "it is through"


def test_beside_the_door_the_robot_is_not_through() -> None:
    passage = Passage()
    passage.x = 0.7
    passage.stand(1.0, y=1.5)
    assert "passage_delay" not in passage.figures()
    passage.stand(0.5)
    assert "passage_delay" in passage.figures()


@pytest.mark.parametrize(("x", "share"), [(-2.0, 0.0), (0.0, 1.0), (-0.1, 1.0), (2.0, 0.0)])
def test_waiting_in_a_doorway_is_counted(x: float, share: float) -> None:
    passage = Passage()
    passage.x = x
    passage.stand(10.0)
    assert passage.figures()["doorway_share"] == share


def test_the_share_in_doorways_is_that_of_all_waiting() -> None:
    other = Door(name="other", x=-4.0, y=-0.5, yaw=math.pi / 2, width=1.0)
    passage = Passage(doors=(DOOR, other))
    passage.x = -4.0
    passage.stand(6.0)
    passage.drive_to(-2.0)
    passage.stand(16.0)
    # the first second of each pause is part of the motion
    assert passage.figures()["doorway_share"] == pytest.approx(5.0 / 20.0, abs=0.02)


@pytest.mark.parametrize(
    ("waits", "reached", "given_up"), [(20.0, False, 1.0), (310.0, False, 0.0), (20.0, True, 0.0)]
)
def test_a_goal_that_ends_before_the_patience_is_given_up(
    waits: float, reached: bool, given_up: float
) -> None:
    passage = blocked()
    passage.stand(waits)
    passage.publish("navigation_status", NavigationStatus(state="idle", reason="the path is blocked"))
    passage.publish("navigation_status", NavigationStatus(state="driving"))
    passage.run.time += 1000.0
    passage.publish("navigation_status", NavigationStatus(state="idle"))
    assert passage.figures(reached)["given_up"] == given_up


def test_a_robot_that_stands_from_the_beginning_is_timed() -> None:
    passage = Passage(begin=-PERIOD)
    passage.people.append(SE2(0.0, 0.0, 0.0))
    passage.x = -1.0
    passage.stand(3.0)
    assert passage.observer.held_up_at == 0.0


def test_people_are_counted_around_the_middle_of_the_door() -> None:
    passage = blocked()
    passage.people.append(SE2(2.0, 0.0, 0.0))
    assert [passage.observer.people_within(distance) for distance in (0.1, 0.31, 2.1)] == [0, 2, 3]
