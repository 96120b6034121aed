"""What a node that plans reports: detours, occupied goals, and the obstacle, zone or lane that closes a path."""
# ruff: noqa: ARG002 (a planner with the interface of all)

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.nodes import NodeRunner

from chefbot.causes.reports import DETOUR, FAILURE, LIDAR, MAP
from chefbot.costmap.params import GLOBAL_COSTMAP, CostmapParams
from chefbot.costmap.sources import LASER
from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.causes.planner_causes import PlannerCausesNode
from chefbot.planning.planner import PlanningError, PlanningFailure

START, GOAL = SE2(1.0, 2.0, 0.0), SE2(5.0, 2.0, 0.0)
Path = NDArray[np.float64]


class CostmapParamsOnly(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters that a node with the costmap of the map must have."""

    costmap: CostmapParams = GLOBAL_COSTMAP


class Planning(PlannerCausesNode):
    """A node that reports the plans that a test gives it."""

    params: CostmapParamsOnly


class Straight:
    """A planner that leads straight to the goal, or nowhere if that is closed."""

    def __init__(self, *, closed: bool = False) -> None:
        self.closed = closed

    def plan(self, costmap: Costmap, start: SE2, goal: SE2) -> Path:
        if self.closed:
            raise PlanningError(PlanningFailure.NO_VALID_PATH, goal)
        return line(start, goal)

    def potential(self, costmap: Costmap, start: SE2) -> NDArray[np.float32]:
        return np.zeros(costmap.cells.shape, np.float32)


def line(*poses: SE2) -> Path:
    """Return poses every 2 cm along straight lines."""
    parts = [np.linspace(a, b, round(50 * a.distance(b)) + 1) for a, b in pairwise(poses)]
    return np.vstack(parts)


def around(away: float) -> Path:
    """Return a path that leads from START to GOAL past a point that far beside the straight one."""
    return line(START, SE2(3.0, 2.0 + away, 0.0), GOAL)


class Hall:
    """A hall of 6 m by 4 m with a wall around it, and what the node reports there."""

    def __init__(self, *zones: MapZone) -> None:
        self.runner = NodeRunner({"planner": f"{__name__}:Planning"}, {})
        self.node: Any = self.runner.system.nodes["planner"]
        cells = np.zeros((80, 120), np.int8)
        cells[[0, -1], :] = cells[:, [0, -1]] = 100
        header = Header.of(0, "map")
        self.publish("map", OccupancyGrid.of(header, Grid(cells, 0.05, 0.0, 0.0)))
        if zones:
            self.publish("zones", MapZones(header, zones))

    def publish(self, topic: str, message: Any) -> None:
        self.runner.loop.publish(topic, message, "test", from_device=True)
        self.runner.run(0.05)

    def mark(self, x: float, y: float) -> None:
        """Mark a cell, at 2 s."""
        costs, cell = self.node._costs, (math.floor(y / 0.05), math.floor(x / 0.05))
        costs.set_time(2.0)
        costs.source_cells(LASER)[cell] = LETHAL
        costs.note_marks(LASER, cell)
        costs.note_all_changed()

    def plan(self, plan: Path, goal: SE2 = GOAL, *, closed: bool = False) -> list[Cause]:
        """Report a plan, and return all reports of its kind so far."""
        self.node.report_plan(plan, Straight(closed=closed), goal, START)
        return self.begun

    def fail(self, failure: PlanningFailure, *, closed: bool = False) -> Cause:
        error = PlanningError(failure, GOAL)
        self.node.report_failure(error, Straight(closed=closed), START, GOAL)
        return self.begun[-1]

    @property
    def begun(self) -> list[Cause]:
        self.runner.run(0.0)
        reports = self.runner.messages("cause_reports")
        assert [one.kind == "end" for one in reports] == [False, True] * (len(reports) // 2)
        return [one for one in reports if one.kind != "end"]


def place(cause: Cause) -> tuple[float, float]:
    assert cause.located and cause.header.frame_id == "map"
    return cause.point.x, cause.point.y


def zone(name: str, kind: str, box: tuple[float, float, float, float], direction: float = 0.0) -> MapZone:
    left, low, right, high = box
    corners = ((left, low), (right, low), (right, high), (left, high))
    return MapZone(name, kind, tuple(Point(x, y) for x, y in corners), 0.0, direction)


# ---- detours


def test_a_plan_around_what_blocks_the_last_one_is_a_detour() -> None:
    hall = Hall()
    assert hall.plan(around(0.0)) == []
    hall.mark(3.02, 2.02)
    (cause,) = hall.plan(around(1.0))
    assert (cause.kind, cause.check, cause.sensor) == (DETOUR, "global plan", LIDAR)
    assert place(cause) == pytest.approx((3.025, 2.025)) and cause.marked_at.ns == 2_000_000_000
    assert {one.name: one.value for one in cause.numbers} == {
        "deviation": pytest.approx(1.0, abs=0.05),
        "extra length": pytest.approx(2.0 * math.sqrt(5.0) - 4.0, abs=1e-6),
    }
    assert cause.sentence == "The new plan deviates 1.0 m from the old one, which is blocked."
    assert len(hall.plan(around(1.0))) == 1, "it is the plan of before"


@pytest.mark.parametrize(
    ("away", "marked", "goal"), [(0.3, True, GOAL), (1.0, False, GOAL), (1.0, True, SE2(5.0, 2.2, 0.0))]
)
def test_other_plans_are_not_detours(away: float, marked: bool, goal: SE2) -> None:
    hall = Hall()
    hall.plan(around(0.0))
    if marked:
        hall.mark(3.02, 2.02)
    assert hall.plan(around(away), goal) == []


BUFFET = zone("buffet", KEEP_OUT, (2.5, 1.5, 3.5, 2.5))


def test_a_zone_on_the_straight_path_is_reported_once_for_a_goal() -> None:
    hall = Hall(BUFFET)
    for _ in range(2):
        (cause,) = hall.plan(around(1.5))
    extra = 2.0 * math.hypot(2.0, 1.5) - 4.0
    assert cause.sensor == "keep-out zone buffet" and 2.2 < place(cause)[0] < 2.6
    assert cause.sentence == f"The plan is {extra:.1f} m longer because of the keep-out zone buffet."
    assert cause.numbers[0].value == pytest.approx(extra)
    other = SE2(5.0, 2.1, 0.0)
    detour = np.vstack([around(1.5), line(GOAL, other)])
    assert len(hall.plan(detour, other)) == 2


@pytest.mark.parametrize(("away", "reported"), [(1.0, False), (1.1, True)])
def test_half_a_metre_more_is_notable(away: float, reported: bool) -> None:
    """1 m aside costs 0.47 m, 1.1 m aside 0.57 m."""
    assert bool(Hall(BUFFET).plan(around(away))) == reported


def test_zones_beside_the_path_and_closed_maps_are_not_a_cause() -> None:
    assert Hall(zone("corner", KEEP_OUT, (0.2, 0.2, 0.6, 0.6))).plan(around(1.5)) == []
    assert Hall(BUFFET).plan(around(1.5), closed=True) == [], "the map itself has no other path"
    hall = Hall(zone("corner", KEEP_OUT, (0.2, 0.2, 0.6, 0.6)))
    hall.mark(3.02, 2.02)
    assert hall.plan(around(1.5)) == [], "what a sensor has marked is not a zone"


def test_a_lane_against_the_straight_path_is_named() -> None:
    west = zone("exit", ONE_WAY, (2.5, 1.0, 3.5, 3.0), math.pi)
    (cause,) = Hall(west).plan(around(1.5))
    assert cause.sentence.endswith("longer because of the one-way lane exit.") and not cause.located
    assert Hall(zone("exit", ONE_WAY, (2.5, 1.0, 3.5, 3.0), 0.0)).plan(around(1.5)) == []


# ---- occupied goals


def test_an_occupied_goal_is_reported_once_until_it_is_free() -> None:
    hall = Hall()
    hall.mark(4.98, 2.02)
    beside, exact = line(START, SE2(4.6, 2.3, 0.0)), line(START, GOAL)
    sentence = hall.node.report_occupied_goal(beside, GOAL)
    assert sentence == "The goal is occupied: the robot drives to a free pose with sight of it, 0.50 m away."
    assert hall.node.report_occupied_goal(beside, GOAL) == sentence
    (cause,) = hall.begun
    assert (cause.check, cause.sensor, cause.numbers[0].value) == ("goal occupied", LIDAR, pytest.approx(0.5))
    assert place(cause) == pytest.approx((4.975, 2.025))
    assert hall.node.report_occupied_goal(exact, GOAL) == "" and len(hall.begun) == 1
    hall.node.report_occupied_goal(beside, GOAL)
    assert len(hall.begun) == 2, "occupied again"
    hall.node.report_occupied_goal(line(START, SE2(4.5, 2.3, 0.0)), GOAL)
    assert len(hall.begun) == 2, "the same pose, shifted by another look at the obstacle"
    hall.node.report_occupied_goal(line(START, SE2(4.6, 1.7, 0.0)), GOAL)
    assert len(hall.begun) == 3, "a pose on the other side of it"


# ---- failures


def test_what_covers_the_goal_or_the_robot_is_named() -> None:
    hall = Hall()
    hall.mark(5.2, 2.0)
    hall.mark(1.0, 2.2)
    for failure, where, because in (
        (PlanningFailure.GOAL_OCCUPIED, (5.225, 2.025), " because of an obstacle"),
        (PlanningFailure.START_OCCUPIED, (1.025, 2.225), ""),
    ):
        cause = hall.fail(failure)
        assert (cause.kind, cause.check, cause.sensor) == (FAILURE, "global plan", LIDAR)
        assert place(cause) == pytest.approx(where)
        assert cause.sentence == f"{failure.value[0].upper()}{failure.value[1:]}{because}."


def test_a_wall_beside_an_occupied_goal_is_the_maps() -> None:
    hall = Hall()
    hall.node.report_failure(
        PlanningError(PlanningFailure.GOAL_OCCUPIED, GOAL), Straight(), START, SE2(5.9, 2.0, 0.0)
    )
    assert hall.begun[0].sensor == MAP and place(hall.begun[0])[0] == pytest.approx(5.975)


@pytest.mark.parametrize("failure", [PlanningFailure.GOAL_OUTSIDE_MAP, PlanningFailure.START_OUTSIDE_MAP])
def test_outside_the_map_no_obstacle_is_named(failure: PlanningFailure) -> None:
    hall = Hall()
    hall.mark(5.0, 2.0)
    hall.mark(1.0, 2.0)
    assert not hall.fail(failure).located


def test_without_a_path_the_first_obstacle_on_the_maps_is_named() -> None:
    hall = Hall()
    hall.mark(4.02, 2.02)
    hall.mark(3.02, 2.02)
    hall.mark(1.0, 2.6)
    cause = hall.fail(PlanningFailure.NO_VALID_PATH)
    assert place(cause) == pytest.approx((3.025, 2.025)) and cause.sensor == LIDAR
    assert not hall.fail(PlanningFailure.NO_VALID_PATH, closed=True).located, "the map has none either"


def test_a_lane_is_named_where_no_obstacle_closes_the_path() -> None:
    west = zone("exit", ONE_WAY, (2.5, 1.0, 3.5, 3.0), math.pi)
    hall = Hall(west)
    sentence = hall.fail(PlanningFailure.NO_VALID_PATH).sentence
    assert sentence == "No path leads to the goal because of the one-way lane exit."
    hall.mark(4.02, 2.02)
    assert "lane" not in hall.fail(PlanningFailure.NO_VALID_PATH).sentence
