"""Tests that people leave no marks behind in the costmaps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import ROBOT, NodeRunner

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sources import CAMERA, CONTACT, DROP_OFFS, LASER
from chefbot.maths.costs import LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, TransformStamped, Vector3
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.people.marks import MAX_AGE, PeopleMarksNode
from chefbot.people.trails import BODY_RADIUS
from chefbot.runtime.node import NoParams, every

PLACE = (1.2, 0.3)
NODES = {"controller": "controller:ControllerNode", "planner": "planner:PlannerNode"}


def person_at(x: float, y: float) -> TrackedPeople:
    """Return one person, well seen."""
    person = TrackedPerson(1, Point(x, y), covariance=0.001 * np.eye(4).reshape(16), visible=True)
    return TrackedPeople(Header.of(0, "odom"), (person,))


def mark(costs: LayeredCostmap, layer: str, distance: float) -> tuple[int, int]:
    """Mark the cell at a distance from PLACE and return it."""
    x, y = PLACE[0] + distance, PLACE[1]
    cell = (
        math.floor((y - costs.origin_y) / costs.resolution),
        math.floor((x - costs.origin_x) / costs.resolution),
    )
    costs.source_cells(layer)[cell] = LETHAL
    costs.note_change(SE2(x, y, 0.0), 0.1)
    return cell


@pytest.mark.parametrize(
    ("layer", "distance", "stays"),
    [
        (CAMERA, 0.2, False),
        (LASER, -0.2, False),
        (CAMERA, 0.4, True),
        (DROP_OFFS, 0.0, True),
        (CONTACT, 0.1, True),
    ],
)
def test_marks_within_a_body_are_cleared(layer: str, distance: float, stays: bool) -> None:
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0), disc(0.16), rolling=True)
    cell = mark(costs, layer, distance)
    assert costs.update().cells[cell] == LETHAL
    costs.clear_discs(np.array([PLACE]), 0.25, keep=(DROP_OFFS, CONTACT))
    assert (costs.source_cells(layer)[cell] == LETHAL) == stays
    assert (costs.update().cells[cell] == LETHAL) == stays


def test_discs_outside_the_costmap_clear_nothing() -> None:
    costs = LayeredCostmap(CostmapParams(), disc(0.16), rolling=True)
    cell = mark(costs, CAMERA, 0.0)
    costs.clear_discs(np.array([[1e6, -1e6], [-50.0, 0.0]]), 0.25)
    assert costs.update().cells[cell] == LETHAL


@pytest.mark.parametrize("name", NODES)
def test_the_mark_of_somebody_seen_elsewhere_is_cleared_at_once(name: str) -> None:
    runner = NodeRunner({name: f"chefbot.nodes.{NODES[name]}"}, {})
    for parent, child in (("map", "odom"), ("odom", "base_footprint"), ("base_footprint", "base_link")):
        transform = TransformStamped.of(0, parent, child, IDENTITY)
        runner.loop.publish("tf_static", TFMessage((transform,)), "test")
    runner.loop.publish(
        "map", OccupancyGrid.of(Header.of(0, "map"), Grid(np.zeros((80, 80), np.int8), 0.05, -2.0, -2.0)), "t"
    )
    runner.run(0.01)
    node: Any = runner.system.nodes[name]
    cell = mark(node._costs, CAMERA, 0.1)
    for x, stays in ((PLACE[0], True), (PLACE[0] + 0.35, True), (PLACE[0] + 0.7, False)):
        runner.loop.publish("tracked_people", person_at(x, PLACE[1]), "test")
        runner.run(0.01)
        assert (node._costs.update().cells[cell] == LETHAL) == stays


def walker(x: float, vx: float) -> TrackedPerson:
    """Return a person on y = 0 with a velocity, well known."""
    return TrackedPerson(1, Point(x, 0.0), Vector3(vx, 0.0), covariance=0.001 * np.eye(4).reshape(16))


@pytest.mark.parametrize(("age", "x"), [(0.1, 2.05), (0.4, 2.2), (0.6, None)])
def test_people_are_where_they_walked_since_the_message(age: float, x: float | None) -> None:
    runner = NodeRunner({"controller": "chefbot.nodes.controller:ControllerNode"}, {})
    transform = TransformStamped.of(0, "odom", "base_link", IDENTITY)
    runner.loop.publish("tf_static", TFMessage((transform,)), "test")
    runner.run(1.0)
    stamp = runner.loop.now_ns + round((0.1 - age) * 1e9)
    runner.loop.publish(
        "tracked_people", TrackedPeople(Header.of(stamp, "odom"), (walker(2.0, 0.5),)), "people"
    )
    runner.run(0.1)
    node: Any = runner.system.nodes["controller"]
    states = node._nearby_people().states
    assert len(states) == 0 if x is None else states[0, :4] == pytest.approx([x, 0.0, 0.5, 0.0])


class Watcher(PeopleMarksNode):
    """The base class with a costmap that notes what is cleared in it."""

    params: NoParams

    def start(self) -> None:
        self.cleared: list[tuple[list[list[float]], float]] = []
        self._costs: Any = self

    def clear_discs(self, places: np.ndarray, radius: float, keep: tuple[str, ...]) -> None:
        assert set(keep) >= {DROP_OFFS, CONTACT}
        self.cleared.append((places.tolist(), radius))

    @every(hz=10)
    def pass_time(self) -> None:
        """Let the time of the loop go on."""


class Watch(NodeRunner):
    """A watcher whose frame odom is turned by 90 degrees against the map."""

    def __init__(self, *, localized: bool = True) -> None:
        super().__init__({"watcher": f"{__name__}:Watcher"}, {})
        self.node: Any = self.system.nodes["watcher"]
        if localized:
            transform = TransformStamped.of(0, "map", "odom", SE2(1.0, 0.0, math.pi / 2))
            self.loop.publish("tf_static", TFMessage((transform,)), "test")
        self.run(1.0)

    def see(self, *people: TrackedPerson, age: float = 0.0) -> None:
        stamp = Header.of(self.loop.now_ns - round(age * 1e9), "map")
        self.loop.publish("tracked_people", TrackedPeople(stamp, people), "tracker")
        self.run(0.0)


def test_what_is_left_is_cleared_in_the_frame_of_the_costmap() -> None:
    watch = Watch()
    for x in (1.0, 1.3, 1.7):
        watch.see(*person_at(x, 0.0).people)
    ((places, radius),) = watch.node.cleared
    assert places == [pytest.approx([0.0, 0.0])] and radius == BODY_RADIUS, "x 1 m on the map is the origin"


def test_without_localization_nothing_is_cleared_and_nobody_near() -> None:
    watch = Watch(localized=False)
    for x in (1.0, 1.3, 1.7):
        watch.see(*person_at(x, 0.0).people)
    assert watch.node.cleared == [] and len(watch.node._nearby_people().states) == 0


@pytest.mark.parametrize(
    ("age", "known"), [(0.0, True), (0.9 * MAX_AGE, True), (1.1 * MAX_AGE, False), (-0.1, False)]
)
def test_people_of_another_time_are_not_known_to_be_near(age: float, known: bool) -> None:
    watch = Watch()
    assert len(watch.node._nearby_people().states) == 0, "before the first message"
    watch.see(walker(3.0, 0.4), age=age)
    nearby = watch.node._nearby_people()
    assert len(nearby.states) == known
    if known:
        assert nearby.contact == pytest.approx(ROBOT.circumscribed_radius + BODY_RADIUS)
        # along -y of the costmap, which is +x of the map, and on by the age
        assert nearby.states[0, :4] == pytest.approx([0.0, -(2.0 + 0.4 * age), 0.0, -0.4], abs=1e-6)
