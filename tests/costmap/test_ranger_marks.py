"""Marks of the ultrasonic ranger and of contacts."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.ranger_marks import contact_radius, mark_contact, mark_range
from chefbot.costmap.sources import CONTACT, LASTING_SOURCES, RANGER
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN
from chefbot.maths.footprint import disc
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.sensor_msgs import Range
from chefbot.robot.load import load_robot

PARAMS = CostmapParams(inflation_radius=0.0, track_unknown=False)
SENSOR = SE2(0.14, 0.0, 0.0)


def costmap() -> LayeredCostmap:
    return LayeredCostmap(PARAMS, disc(0.15), rolling=True)


def echo(metres: float) -> Range:
    return Range(field_of_view=math.radians(30.0), min_range=0.02, max_range=4.0, range=metres)


def marked(costs: LayeredCostmap, name: str) -> int:
    return int((costs.source_cells(name) == LETHAL).sum())


@pytest.mark.parametrize("metres", [0.3, 0.6, 0.9])
def test_glass_is_marked_by_repeated_echoes(metres: float) -> None:
    costs = costmap()
    for _ in range(3):
        mark_range(costs, SENSOR, echo(metres))
    assert costs.update().at(SENSOR.x + metres, 0.01) == LETHAL
    assert costs.update().at(SENSOR.x + metres / 2.0, 0.01) != LETHAL
    assert FREE not in costs.source_cells(RANGER)  # the ranger alone calls nothing free


def test_the_cone_clears_what_has_left() -> None:
    costs = costmap()
    mark_contact(costs, IDENTITY, 0.32)
    for _ in range(3):
        mark_range(costs, SENSOR, echo(0.32 - SENSOR.x))
    assert marked(costs, RANGER) and marked(costs, CONTACT)
    for _ in range(20):
        mark_range(costs, SENSOR, echo(1.5))
    assert not marked(costs, RANGER) and costs.update().at(0.32, 0.01) != LETHAL


def test_the_cone_does_not_clear_what_it_has_not_marked() -> None:
    """The ranger looks below a board that hangs before the robot: it was there all the time."""
    costs = costmap()
    mark_contact(costs, IDENTITY, 0.32)
    touched = marked(costs, CONTACT)
    for _ in range(20):
        mark_range(costs, SENSOR, echo(1.5))
    assert marked(costs, CONTACT) == touched > 0


def test_a_door_post_explains_an_echo() -> None:
    costs = costmap()
    post = np.array([0.15]), np.array([0.6])
    costs.mark_and_clear("laser", SENSOR, *post)
    for _ in range(5):
        mark_range(costs, SENSOR, echo(0.6))
    assert not costs.has_source(RANGER)
    for _ in range(5):
        mark_range(costs, SENSOR, echo(0.4))  # the post is too far away to explain this
    assert marked(costs, RANGER)


@pytest.mark.parametrize(("bearing", "explained"), [(0.33, True), (-0.33, True), (0.6, False)])
def test_a_table_leg_at_the_edge_of_the_cone_explains_an_echo(bearing: float, explained: bool) -> None:
    """The cone ends at 0.26 rad: while the robot turns, the leg is still in it or already."""
    costs = costmap()
    costs.mark_and_clear("laser", SENSOR, np.array([bearing]), np.array([0.4]))
    for _ in range(5):
        mark_range(costs, SENSOR, echo(0.4))
    assert costs.has_source(RANGER) != explained


@pytest.mark.parametrize("metres", [math.inf, -math.inf, math.nan, 1.2, 0.01])
def test_no_echo_and_far_echoes_mark_nothing(metres: float) -> None:
    costs = costmap()
    for _ in range(5):
        mark_range(costs, SENSOR, echo(metres))
    assert not costs.has_source(RANGER)


def test_no_echo_clears_nothing() -> None:
    costs = costmap()
    for _ in range(3):
        mark_range(costs, SENSOR, echo(0.5))
    before = marked(costs, RANGER)
    mark_range(costs, SENSOR, echo(math.inf))
    assert marked(costs, RANGER) == before > 0


@pytest.mark.parametrize("yaw", [0.0, math.pi])
def test_a_contact_is_marked_where_the_robot_drove_to(yaw: float) -> None:
    costs, radius = costmap(), contact_radius(load_robot("chefbot"))
    mark_contact(costs, SE2(0.0, 0.0, yaw), radius)
    assert 1 <= marked(costs, CONTACT) <= 3
    _, columns = np.nonzero(costs.source_cells(CONTACT) == LETHAL)
    x = costs.origin_x + (columns + 0.5) * costs.resolution
    assert (np.sign(x) == (1.0 if yaw == 0.0 else -1.0)).all()


def test_laser_and_recovery_keep_what_they_do_not_see() -> None:
    costs = costmap()
    mark_contact(costs, IDENTITY, 0.32)
    costs.mark_and_clear("laser", IDENTITY, np.linspace(-0.5, 0.5, 21), np.full(21, 3.0))
    costs.clear_around(IDENTITY, 2.0, keep=LASTING_SOURCES)
    costs.clear_footprint(IDENTITY)
    assert costs.update().at(0.32, 0.01) == LETHAL
    costs.clear_around(IDENTITY, 2.0)
    assert costs.source_cells(CONTACT).max() == UNKNOWN and not marked(costs, CONTACT)


def test_an_echo_from_outside_the_costmap_does_nothing() -> None:
    costs = costmap()
    mark_range(costs, SE2(50.0, 0.0, 0.0), echo(0.5))
    mark_contact(costs, SE2(50.0, 0.0, 0.0), 0.2)
    assert not marked(costs, RANGER) and not marked(costs, CONTACT)


@pytest.mark.parametrize("width", [0.0, -1.0, math.nan])
def test_an_echo_without_a_cone_marks_nothing(width: float) -> None:
    costs = costmap()
    mark_range(costs, SENSOR, Range(field_of_view=width, min_range=0.02, max_range=4.0, range=0.5))
    assert not costs.has_source(RANGER)


def test_contacts_and_echoes_that_nothing_confirms_decay() -> None:
    costs = LayeredCostmap(msgspec.structs.replace(PARAMS, decay_time=60.0), disc(0.15), rolling=True)
    costs.set_time(1.7e9)  # a wall clock
    mark_contact(costs, SE2(0.0, 0.0, math.pi), 0.3)
    for _ in range(5):
        mark_range(costs, SENSOR, echo(0.6))
    costs.set_time(1.7e9 + 59.0)
    assert marked(costs, CONTACT) and marked(costs, RANGER)
    costs.set_time(1.7e9 + 61.0)
    assert not marked(costs, CONTACT) and not marked(costs, RANGER)
