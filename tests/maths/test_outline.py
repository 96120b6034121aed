"""Shapes of lines and arcs: exact moments against fine polygons, which know nothing of arcs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.outline import (
    Corner,
    Outline,
    arc_between,
    arc_bulge,
    circle,
    loop_moments,
    points,
    rectangle,
)

FINE = 1e-9
sizes = st.floats(0.01, 2.0)
offsets = st.floats(-3.0, 3.0)


def polygon_moments(loop):
    """The shoelace formula over corners only, written with arrays instead of corner by corner."""
    x, y = np.array(loop).T
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    return np.array(
        [
            cross.sum() / 2,
            ((x + u) * cross).sum() / 6,
            ((y + v) * cross).sum() / 6,
            ((x * x + x * u + u * u) * cross).sum() / 12,
            ((y * y + y * v + v * v) * cross).sum() / 12,
            ((x * v + 2 * x * y + 2 * u * v + u * y) * cross).sum() / 24,
        ]
    )


@st.composite
def loops(draw):
    """A convex polygon round a middle whose edges are bent outwards, inwards or not."""
    count, radius, x, y = draw(st.integers(3, 7)), draw(sizes), draw(offsets), draw(offsets)
    bends = draw(st.lists(st.sampled_from((-0.15, 0.0, 0.1, 0.6)), min_size=count, max_size=count))
    angles = 2 * math.pi * np.arange(count) / count
    return tuple(
        Corner(x + radius * math.cos(t), y + radius * math.sin(t), bend)
        for t, bend in zip(angles, bends, strict=True)
    )


@settings(max_examples=60)
@given(loops())
def test_moments_equal_those_of_a_fine_polygon(loop):
    deviation = 1e-7
    polygon = np.array(points(loop, deviation))
    between = deviation * np.hypot(*(np.roll(polygon, -1, axis=0) - polygon).T).sum()
    reach = np.hypot(*polygon.T).max() + deviation
    bound = between * np.array([1, reach, reach, reach**2, reach**2, reach**2])
    assert np.all(np.abs(np.array(loop_moments(loop)) - polygon_moments(polygon)) <= bound + 1e-12)


@given(sizes, offsets, offsets)
def test_a_circle_has_the_closed_form_moments(radius, x, y):
    area, own = math.pi * radius**2, math.pi * radius**4 / 4
    wanted = [area, area * x, area * y, own + area * x**2, own + area * y**2, area * x * y]
    assert loop_moments(circle(radius, x, y)) == pytest.approx(wanted, rel=1e-9, abs=1e-9)


@given(sizes, sizes, offsets, offsets)
def test_a_rectangle_has_the_closed_form_moments(width, height, x, y):
    area = width * height
    wanted = [
        area, area * x, area * y,
        area * (width**2 / 12 + x**2), area * (height**2 / 12 + y**2), area * x * y,
    ]  # fmt: skip
    assert loop_moments(rectangle(width, height, x, y)) == pytest.approx(wanted, rel=1e-9, abs=1e-9)


@given(sizes, st.floats(0.1, 0.9), offsets)
def test_a_hole_subtracts_its_moments(radius, share, x):
    hole = circle(share * radius, x)
    ring = Outline(circle(radius, x), (hole,)).moments()
    wanted = np.array(loop_moments(circle(radius, x))) - np.array(loop_moments(hole))
    assert ring == pytest.approx(wanted.tolist(), rel=1e-12, abs=1e-12)


@given(sizes, st.floats(-math.pi, math.pi), st.floats(-6.0, 6.0).filter(lambda turn: abs(turn) > 1e-2))
def test_an_arc_is_recovered_from_its_ends_and_bulge(radius, start, turn):
    bulge = arc_bulge(turn)
    a = Corner(radius * math.cos(start), radius * math.sin(start), bulge)
    b = Corner(radius * math.cos(start + turn), radius * math.sin(start + turn))
    arc = arc_between(a, b)
    assert arc.turn == pytest.approx(turn, rel=1e-9)
    if turn > 0:
        assert (arc.x, arc.y, arc.radius) == pytest.approx((0, 0, radius), rel=1e-6, abs=1e-6)


@given(sizes, st.floats(1e-5, 1e-2))
def test_chord_points_deviate_no_more_than_allowed(radius, deviation):
    ring = np.array(points(circle(radius), deviation))
    middles = (ring + np.roll(ring, -1, axis=0)) / 2
    assert np.allclose(np.hypot(*ring.T), radius)
    assert (radius - np.hypot(*middles.T)).max() <= deviation * (1 + 1e-9) + FINE
    assert len(ring) >= 24
