"""Where the closed form of the time until contact is delicate: at the skin, on straight paths, on the spot."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.safety.contact_time import disc_contact, distance_from_body, first_contact, polygon_contact

RADIUS = 0.15
DISC = np.zeros((0, 2))
SQUARE = np.array([[-0.2, -0.1], [0.3, -0.1], [0.3, 0.1], [-0.2, 0.1]])
"""A rectangle from 0.2 m behind to 0.3 m before the axle, 0.2 m wide."""
angles = st.floats(-math.pi, math.pi)
speeds = st.floats(-1.0, 1.0)
rates = st.floats(-2.0, 2.0)


@given(angles, st.floats(-16.0, -6.1), speeds, rates)
def test_a_disc_does_not_press_on_what_it_touches(
    bearing: float, exponent: float, v: float, w: float
) -> None:
    """However little outside the skin: by rounding, the contact due now was found a whole turn later."""
    r = RADIUS + 10.0**exponent
    x, y = r * math.cos(bearing), r * math.sin(bearing)
    if v * x > 0.01 * RADIUS:
        assert disc_contact(x, y, v, w, RADIUS) == 0.0
    elif v * x < -0.01 * RADIUS:
        assert disc_contact(x, y, v, w, RADIUS) == math.inf


@given(st.integers(0, 3), st.floats(0.01, 0.99), st.floats(-16.0, -6.1), speeds, rates)
def test_a_rectangle_does_not_press_on_what_it_touches(
    side: int, share: float, exponent: float, v: float, w: float
) -> None:
    a, b = SQUARE[side], SQUARE[(side + 1) % 4]
    outwards = np.array([b[1] - a[1], a[0] - b[0]]) / np.linalg.norm(b - a)
    x, y = (a + share * (b - a) + 10.0**exponent * outwards).tolist()
    coming = float(np.dot([v - w * y, w * x], outwards))
    if coming > 0.01:
        assert polygon_contact(x, y, v, w, SQUARE) == 0.0
    elif coming < -0.01:
        assert polygon_contact(x, y, v, w, SQUARE) == math.inf


@pytest.mark.parametrize("x", [-1.0, -0.2, 0.0, 0.3, 1.0])
def test_a_robot_that_stands_touches_nothing(x: float) -> None:
    for y in (0.0, 0.1, 0.15, 1.0):
        assert polygon_contact(x, y, 0.0, 0.0, SQUARE) == math.inf == disc_contact(x, y, 0.0, 0.0, RADIUS)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_straight_paths_worked_out_by_hand(sign: float) -> None:
    """The chord of a disc at 0.09 m beside its middle is 0.12 m long on each side."""
    for w in (0.0, 1e-6, -1e-6):
        assert disc_contact(sign * 0.62, 0.09, sign * 0.5, w, RADIUS) == pytest.approx(1.0, abs=1e-4)
        assert disc_contact(sign * 0.62, 0.09, -sign * 0.5, w, RADIUS) > 10.0
        assert disc_contact(sign * 0.62, 0.1501, sign * 0.5, w, RADIUS) == math.inf
        assert disc_contact(sign * 0.62, -0.1499, sign * 0.5, w, RADIUS) < 1.3
    assert polygon_contact(0.8, 0.05, 0.5, 0.0, SQUARE) == pytest.approx(1.0)
    assert polygon_contact(-0.7, -0.05, -0.5, 0.0, SQUARE) == pytest.approx(1.0)
    assert polygon_contact(0.8, 0.0999, 0.5, 0.0, SQUARE) == pytest.approx(1.0)
    assert polygon_contact(0.8, 0.101, 0.5, 0.0, SQUARE) == math.inf
    assert polygon_contact(0.8, 0.05, -0.5, 0.0, SQUARE) == math.inf


def test_a_slanted_edge_is_met_where_the_path_crosses_it() -> None:
    """A nose from 0.2 m at the sides to 0.4 m in the middle: beside the middle by half of it, 0.3 m."""
    nose = np.array([[-0.2, -0.2], [0.2, -0.2], [0.4, 0.0], [0.2, 0.2], [-0.2, 0.2]])
    for y in (0.1, -0.1):
        assert polygon_contact(0.8, y, 0.25, 0.0, nose) == pytest.approx(2.0)
    for y in (0.0, 0.0001):
        assert polygon_contact(0.9, y, 0.25, 0.0, nose) == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize("v", [0.1, 1.0, 3.0])
@pytest.mark.parametrize(("curvature", "bends"), [(0.9e-4, False), (1e-4, True), (1.5e-4, True)])
def test_a_tenth_of_a_millimetre_per_metre_is_not_a_curve(v: float, curvature: float, bends: bool) -> None:
    """On a metre a curve of 1e-4 / m leads 0.05 mm to the side, where a post is that a straight path misses."""
    beside = 0.00002
    assert (disc_contact(1.0, RADIUS + beside, v, curvature * v * 1.0000001, RADIUS) < 2.0 / v) == bends
    assert (disc_contact(1.0, -RADIUS - beside, v, -curvature * v * 1.0000001, RADIUS) < 2.0 / v) == bends
    assert (polygon_contact(1.3, 0.1 + beside, v, curvature * v * 1.0000001, SQUARE) < 2.0 / v) == bends


def test_the_limit_of_a_straight_path_itself() -> None:
    """Without a motion a path is straight, not a turn about a point."""
    assert disc_contact(1.0, RADIUS + 0.00002, 1.0, 1e-4, RADIUS) < math.inf
    assert polygon_contact(1.3, 0.1 + 0.00002, 1.0, 1e-4, SQUARE) == math.inf
    assert polygon_contact(1.0, 0.0, 0.0, 0.0, SQUARE) == math.inf


FRONT_AT_ZERO = np.array([[-0.5, -0.25], [0.0, -0.25], [0.0, 0.25], [-0.5, 0.25]])
"""A rectangle whose distances from points ahead are exact."""


@pytest.mark.parametrize(("gap", "touches"), [(0.9e-6, True), (1e-6, True), (1.5e-6, False)])
def test_a_micrometre_is_contact(gap: float, touches: bool) -> None:
    """Beyond it the distance that is left counts."""
    time = polygon_contact(gap, 0.0, 0.5, 0.0, FRONT_AT_ZERO)
    assert time == (0.0 if touches else pytest.approx(gap / 0.5))
    time = disc_contact(1.0 + gap, 0.0, 0.5, 0.0, 1.0)
    assert (time == 0.0) == touches and time == pytest.approx(0.0 if touches else gap / 0.5, abs=1e-9)


@pytest.mark.parametrize(("v", "comes"), [(0.9e-6, False), (1e-6, False), (1.5e-6, True)])
def test_a_micrometre_per_second_presses_on_nothing(v: float, comes: bool) -> None:
    assert polygon_contact(0.0, 0.0, v, 0.0, FRONT_AT_ZERO) == (0.0 if comes else math.inf)
    for radius in (1.0, 0.25):
        assert disc_contact(radius, 0.0, v, 0.0, radius) == (0.0 if comes else math.inf)
        assert disc_contact(-radius, 0.0, -v, 0.0, radius) == (0.0 if comes else math.inf)


@pytest.mark.parametrize(("v", "moves"), [(0.9e-6, False), (1e-6, True)])
def test_from_a_micrometre_per_second_on_a_robot_moves(v: float, moves: bool) -> None:
    expected = pytest.approx(0.25 / v) if moves else math.inf
    assert polygon_contact(0.25, 0.0, v, 0.0, FRONT_AT_ZERO) == expected
    assert disc_contact(0.5, 0.0, v, 0.0, 0.25) == expected


def test_what_a_disc_grazes_is_free_and_a_flat_front_meets_it() -> None:
    """In numbers that binary fractions hold: beside a straight path, outside of a circle, and at a flat front."""
    assert disc_contact(1.0, 0.25, 0.5, 0.0, 0.25) == math.inf == disc_contact(1.0, -0.25, 0.5, 0.0, 0.25)
    assert disc_contact(0.75, 0.5, 0.5, 1.0, 0.25) == math.inf
    flat = np.array([[0.25, -0.25], [0.5, -0.25], [0.5, 0.25], [0.25, 0.25]])
    assert polygon_contact(0.0, 0.375, 0.125, 1.0, flat) == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_quarter_of_a_circle_worked_out_by_hand(sign: float) -> None:
    """At 0.5 m/s and 1 rad/s the robot drives about a point 0.5 m beside it; a quarter takes pi / 2 seconds."""
    v, w = 0.5, sign
    # a post at the end of the quarter; the disc touches it earlier by the angle of a chord of its radius
    chord = 2.0 * math.asin(RADIUS / 2.0 / 0.5)
    assert disc_contact(0.5, sign * 0.5, v, w, RADIUS) == pytest.approx(math.pi / 2 - chord)
    # backwards it comes from the other side, three quarters later
    assert disc_contact(0.5, sign * 0.5, -v, -w, RADIUS) == pytest.approx(3 * math.pi / 2 - chord)
    # a post in the middle of the circle, and one that the circle passes too far away
    assert disc_contact(0.0, sign * 0.5, v, w, RADIUS) == math.inf
    assert disc_contact(0.0, sign * 0.5 + 1e-4, v, w, RADIUS) == math.inf
    for gap in (RADIUS + 0.001, -RADIUS - 0.001):
        assert disc_contact(0.5 + gap, sign * 0.5, v, w, RADIUS) == math.inf
    for gap in (RADIUS - 0.001, -RADIUS + 0.001):
        assert disc_contact(0.5 + gap, sign * 0.5, v, w, RADIUS) == pytest.approx(math.pi / 2, abs=0.05)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_on_the_spot_the_corners_sweep_a_ring(sign: float) -> None:
    """Near the front corner, 0.316 m from the axle, the side turns into a post beside the robot."""
    corner = math.hypot(0.3, 0.1)
    # the side, 0.1 m beside the axle, is 0.31 m away at this bearing from it
    met = math.asin(0.1 / 0.31)
    for rate in (0.5, 2.0):
        turn = polygon_contact(0.0, sign * 0.31, 0.0, sign * rate, SQUARE) * rate
        assert turn == pytest.approx(math.pi / 2 - met)
    assert polygon_contact(0.0, sign * (corner + 0.001), 0.0, sign, SQUARE) == math.inf
    assert polygon_contact(0.0, sign * 0.31, 1e-9, 0.0, SQUARE) == math.inf
    assert disc_contact(RADIUS + 0.01, 0.0, 0.0, sign, RADIUS) == math.inf
    assert disc_contact(RADIUS + 0.01, 0.0, 1e-7, sign, RADIUS) == math.inf


@pytest.mark.parametrize(("depth", "seen"), [(0.074, False), (0.076, True)])
def test_what_lies_deep_inside_is_a_part_of_the_robot(depth: float, seen: bool) -> None:
    """Half of the inscribed radius and less: a pole in front of the lidar does not stop the robot forever."""
    for point in ([depth, 0.0], [depth * 0.6, depth * 0.8], [depth * 0.6, -depth * 0.8]):
        time, index = first_contact(np.array([point]), 0.3, 0.0, RADIUS, DISC, 0.15)
        assert (time, index) == ((0.0, 0) if seen else (math.inf, -1))


def test_a_part_of_the_robot_hides_no_other_point() -> None:
    points = np.array([[0.05, 0.0], [0.5, 0.0]])
    assert first_contact(points, 1.0, 0.0, RADIUS, DISC, 0.15) == (pytest.approx(0.35), 1)
    assert first_contact(np.array([[0.25, 0.0]]), 1.0, 0.0, 0.5, DISC, 0.5) == (0.0, 0), (
        "half of it and more counts"
    )


def test_of_equal_points_the_first_counts() -> None:
    points = np.array([[0.9, 0.0], [0.5, 0.0], [0.5, 0.0]])
    for corners, radius in ((DISC, 0.3), (SQUARE, 0.0)):
        assert first_contact(points, 1.0, 0.0, radius, corners, 0.1) == (pytest.approx(0.2), 1)


@pytest.mark.parametrize(
    ("x", "y", "distance"),
    [
        (0.5, 0.0, 0.2),
        (-0.3, 0.05, 0.1),
        (0.1, -0.4, 0.3),
        (0.6, 0.5, 0.5),
        (-0.5, -0.5, 0.5),
        (0.29, 0.0, -0.01),
        (0.0, 0.0, -0.1),
        (0.3, 0.0, 0.0),
    ],
)
def test_distances_from_a_rectangle_worked_out_by_hand(x: float, y: float, distance: float) -> None:
    assert distance_from_body(x, y, 9.0, SQUARE) == pytest.approx(distance, abs=1e-12)
    assert distance_from_body(x, y, RADIUS, DISC) == pytest.approx(math.hypot(x, y) - RADIUS)


def test_a_point_that_moves_along_the_skin_is_not_a_contact() -> None:
    """A rectangle drives along what touches its side, and a point in it that comes no nearer does not stop it."""
    assert polygon_contact(0.0, 0.1, 1.0, 0.0, SQUARE) == math.inf
    assert polygon_contact(0.3, 0.0, 0.0, 1.0, SQUARE) == math.inf, "the middle of the front moves sidewards"
    # seen from a robot that turns to the left, what is before it moves to the right: w y - v forward, -w x sidewards
    assert polygon_contact(0.3, 0.05, 0.0, 1.0, SQUARE) == math.inf
    assert polygon_contact(0.3, -0.05, 0.0, 1.0, SQUARE) == 0.0
