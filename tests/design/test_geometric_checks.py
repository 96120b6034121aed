"""Checks of screw holes, supports and drive, and the visibility of lines, against independent geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.design.checks.drive_checks import check_drive
from chefbot.design.checks.finding import with_value
from chefbot.design.checks.screw_holes import _distance, _inside, _margin, holes
from chefbot.design.checks.support import check_support
from chefbot.design.drawing.hidden_lines import visible
from chefbot.design.drawing.views import ViewShape
from chefbot.maths.outline import circle, rectangle
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.load import built_in_robots, load_robot

CHEFBOT = load_robot("chefbot")
POINTS = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


def star(seed: int, n: int) -> np.ndarray:
    """A star-shaped polygon (n, 2) about the origin, counter-clockwise."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2 * math.pi, n, endpoint=False)
    return rng.uniform(0.5, 2.0, (n, 1)) * np.column_stack([np.cos(angles), np.sin(angles)])


@given(st.integers(0, 999), st.integers(3, 12), POINTS)
def test_distance_and_containment_equal_those_of_shapely(seed: int, n: int, at: tuple[float, float]) -> None:
    loop, point = star(seed, n), shapely.Point(at)
    polygon = shapely.Polygon(loop)
    edge = polygon.exterior.distance(point)
    assert _distance(np.array(at), loop) == pytest.approx(edge, abs=1e-9)
    assume(edge > 1e-9)
    assert _inside(np.array(at), loop) == polygon.contains(point)
    assert _margin(at, [loop]) == pytest.approx(edge if polygon.contains(point) else -edge)


@given(POINTS)
def test_a_hole_inside_another_hole_has_a_negative_margin(at: tuple[float, float]) -> None:
    outer, inner = (size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) for size in (2.5, 1.0))
    material = shapely.Polygon(outer, [inner])
    distance = material.boundary.distance(shapely.Point(at))
    assume(distance > 1e-9)
    expected = distance if material.contains(shapely.Point(at)) else -distance
    assert _margin(at, [outer, inner]) == pytest.approx(expected)


@pytest.mark.parametrize("name", sorted(built_in_robots()))
def test_built_in_robots_have_sound_holes_supports_and_drives(name: str) -> None:
    robot = load_robot(name)
    found = [*holes(robot), *check_support(robot), *check_drive(robot, load_catalogue())]
    assert [one for one in found if one.severity == "error"] == []


def test_holes_outside_the_plate_and_too_close_are_errors() -> None:
    found = list(holes(with_value(CHEFBOT, "poles.reach", 0.149)))
    assert {(one.severity, one.subject, one.key) for one in found} >= {
        ("error", "base_plate", "poles.reach"),
        ("error", "plates above", "poles.reach"),
    }
    counts = [len(list(holes(with_value(CHEFBOT, "plates.screw_hole", d)))) for d in (0.003, 0.012, 0.02)]
    assert counts == sorted(counts) and counts[0] == 0 < counts[1]


def test_a_box_beyond_the_plate_has_a_remedy_that_passes() -> None:
    key = "equipment[0].place.x"
    (found,) = (one for one in check_support(with_value(CHEFBOT, key, 0.14)) if one.rule == "edge")
    assert found.key == key and found.have < found.bound
    metres = float(found.value.removesuffix(" mm")) / 1000.0
    assert not any(one.rule == "edge" for one in check_support(with_value(CHEFBOT, key, metres)))


def test_more_load_never_passes_more_drive_checks() -> None:
    catalogue = load_catalogue()
    heavier = [with_value(CHEFBOT, "body.payload", payload) for payload in (2.0, 8.0, 20.0)]
    counts = [sum(one.severity == "error" for one in check_drive(robot, catalogue)) for robot in heavier]
    assert counts == sorted(counts) and counts[0] == 0 < counts[-1]


@given(st.lists(st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(3, 9)), min_size=1, max_size=5))
@settings(max_examples=12)
def test_visible_areas_add_up_to_the_union(boxes: list[tuple[float, float, float]]) -> None:
    shapes = [ViewShape(rectangle(side, side, x, y), near=float(i)) for i, (x, y, side) in enumerate(boxes)]
    polygons = [shapely.box(x - s / 2, y - s / 2, x + s / 2, y + s / 2) for x, y, s in boxes]
    seen = visible(shapes)
    total = shapely.union_all(polygons).area
    assert sum(one.area for one in seen) == pytest.approx(total, abs=0.3 * len(boxes))
    assert seen[-1].area == pytest.approx(polygons[-1].area, abs=0.01), "the nearest shape is not covered"
    for one, polygon in zip(seen, polygons, strict=True):
        if one.area:
            assert polygon.buffer(1e-3).contains(shapely.Point(one.anchor))


def test_covered_shapes_show_no_line_and_free_arcs_stay_arcs() -> None:
    covered, disc = ViewShape(rectangle(2.0, 2.0)), ViewShape(circle(5.0), near=1.0)
    hidden, shown = visible([covered, disc])
    assert hidden.items == [] and hidden.area == 0.0
    (item,) = shown.items
    assert item == visible([disc])[0].items[0]
