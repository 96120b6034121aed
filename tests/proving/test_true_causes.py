"""The comparison of kept causes with the truth: agreement, ghosts, wrong maps, and what standing was explained."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from chefbot.causes.reports import END, STOP
from chefbot.causes.sentences import NOT_ON_MAP, ON_MAP
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import Cause, NavigationStatus
from chefbot.msgs.geometry_msgs import Point, Pose
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import Header
from chefbot.proving.true_causes import TOLERANCE, TrueCauses
from chefbot.robot.load import load_robot
from chefbot.runtime.loop import Publication
from chefbot.sim.ground_truth import GroundTruth
from chefbot.sim.world.shapes import SimulatedShape, box

SECOND = 1_000_000_000
ROBOT = load_robot("chefbot_lidar")
WALL = box("wall_0", SE2(3.0, 0.0, 0.0), 0.0, (0.1, 4.0, 2.0), (0, 0, 0))
DROPPED = box("dropped_1", SE2(0.0, 2.0, 0.0), 0.0, (0.4, 0.4, 0.4), (0, 0, 0))


@dataclass
class FakeWorld:
    static: tuple[SimulatedShape, ...] = (WALL,)


@dataclass
class FakeSimulation:
    """A simulator with a wall, a box and people who stand where a test puts them."""

    robot: Any = ROBOT
    world: FakeWorld = field(default_factory=FakeWorld)
    people: list[SE2] = field(default_factory=list)
    pose: SE2 = IDENTITY
    v: float = 0.0

    def solids(self) -> list[SimulatedShape]:
        return [WALL, DROPPED._replace()]

    def truth(self) -> GroundTruth:
        return GroundTruth(self.pose, self.v, 0.0)


def true_map() -> Grid:
    cells = np.zeros((120, 120), np.int8)
    cells[20:100, 99:101] = 100  # the wall, whose middle is at x = 3 m
    return Grid(cells, 0.05, -2.0, -3.0)


class Run:
    """Publications to the observer, in order of time."""

    def __init__(self) -> None:
        self.simulation = FakeSimulation()
        self.judge = TrueCauses(self.simulation, (0.02, 0.6), true_map(), 1)  # type: ignore[arg-type]

    def publish(self, topic: str, message: Message, seconds: float) -> None:
        self.judge(Publication(topic, message, "test", False, round(seconds * SECOND), False))

    def look(self, seconds: float) -> None:
        self.publish("ground_truth", Odometry(), seconds)

    def keep(self, x: float, y: float, obstacle: str, marked: float = 1.0, robot: SE2 = IDENTITY) -> bool:
        """Publish a cause and return whether it agrees."""
        cause = Cause(
            Header.of(10 * SECOND, "map"),
            1,
            STOP,
            sensor="lidar",
            located=True,
            point=Point(x, y, 0.0),
            marked_at=Time.of(round(marked * SECOND)),
            obstacle=obstacle,
            robot=Pose.of(robot),
        )
        self.publish("causes", cause, 10.0)
        return self.judge.judged[-1].agrees


@pytest.fixture
def run() -> Run:
    made = Run()
    made.look(1.0)
    return made


def test_what_stands_there_agrees_if_the_map_is_right_about_it(run: Run) -> None:
    assert run.keep(2.95, 0.5, ON_MAP) and not run.keep(2.95, 0.5, NOT_ON_MAP)
    assert run.keep(0.0, 1.8, NOT_ON_MAP) and not run.keep(0.0, 1.8, ON_MAP)


def test_a_place_where_nothing_stood_never_agrees(run: Run) -> None:
    assert not run.keep(0.0, 1.8 - 1.5 * TOLERANCE, NOT_ON_MAP)
    assert run.judge.judged[-1].truth == "nothing"


def test_a_person_counts_where_she_stood_at_the_mark(run: Run) -> None:
    run.simulation.people = [SE2(1.0, -1.0, 0.0)]
    run.look(5.0)
    assert not run.keep(1.0, -0.95, NOT_ON_MAP, marked=1.0)
    assert run.keep(1.0, -0.95, NOT_ON_MAP, marked=5.0)
    assert run.judge.judged[-1].truth == "person_0"


def test_the_error_of_the_pose_does_not_move_the_place(run: Run) -> None:
    """The robot believes to be 1 m behind where it is."""
    assert run.keep(1.95, 0.0, ON_MAP, robot=SE2(-1.0, 0.0, 0.0))
    assert run.judge.judged[-1].pose_error == pytest.approx(1.0)


def test_standing_with_a_goal_needs_a_reason() -> None:
    run = Run()
    run.publish("navigation_status", NavigationStatus(state="driving"), 0.0)
    for tick in range(101):
        run.simulation.v = 0.0 if 20 <= tick <= 50 or 70 <= tick <= 90 else 0.3
        run.look(tick / 10)
    assert run.judge.standing.intervals == [(2 * SECOND, 5_100_000_000), (7 * SECOND, 9_100_000_000)]
    begun = Cause(Header.of(round(2.2 * SECOND), "map"), 1, STOP)
    ended = Cause(Header.of(round(4.0 * SECOND), "map"), 1, END)
    assert run.judge.standing.explained([begun, ended]) == [True, False]


def test_a_robot_without_a_goal_may_stand() -> None:
    run = Run()
    for state in ("idle", "driving", "idle"):
        run.publish("navigation_status", NavigationStatus(state=state), 0.0)
        for tick in range(5):
            run.look(tick / 10)
    assert run.judge.standing.intervals == []
