"""The polygons of the collision monitor, worked out by hand for a disc and a rectangle."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot
from chefbot.safety.monitor_polygons import CREEP_SPEED, MonitorPolygons, outline_points, safe_fraction

DISC, RECTANGLE = load_robot("chefbot"), load_robot("jackal")


def faster(speed: float, acceleration: float) -> Robot:
    """Return the chefbot with a lidar and other motors."""
    robot = load_robot("chefbot_lidar")
    drive = msgspec.structs.replace(robot.drive, max_speed=speed, max_acceleration=acceleration)
    motor = msgspec.structs.replace(robot.motor, no_load_speed=400.0, stall_torque=50.0)
    return msgspec.structs.replace(robot, drive=drive, motor=motor)


def test_polygons_of_a_disc() -> None:
    polygons, r = MonitorPolygons.of(DISC, 0.01, 0.03), DISC.circumscribed_radius
    assert (polygons.inscribed, polygons.circumscribed) == (DISC.inscribed_radius, r)
    assert (polygons.stop_radius, polygons.slow_radius) == (r + 0.01, r + 0.03)
    assert len(polygons.corners) == len(polygons.stop_corners) == len(polygons.slow_corners) == 0
    assert polygons.limits == Limits.of(DISC)
    # 0.6 of 0.5 m/s^2, and half a second of latency
    assert polygons.reach == pytest.approx(r + 0.03 + 0.35**2 / (2 * 0.6 * 0.5) + 0.35 * 0.5)
    assert polygons.resolution == pytest.approx(DISC.inscribed_radius / 6)


def test_polygons_of_a_rectangle_grow_on_all_sides() -> None:
    polygons = MonitorPolygons.of(RECTANGLE, 0.01, 0.03)
    for corners, margin in (
        (polygons.corners, 0.0),
        (polygons.stop_corners, 0.01),
        (polygons.slow_corners, 0.03),
    ):
        assert corners.max(axis=0) == pytest.approx(RECTANGLE.footprint.polygon().max(axis=0) + margin)
        assert corners.min(axis=0) == pytest.approx(RECTANGLE.footprint.polygon().min(axis=0) - margin)


@pytest.mark.parametrize("robot", [DISC, RECTANGLE], ids=lambda robot: robot.name)
def test_the_outline_lies_inside_and_has_no_gaps(robot: Robot) -> None:
    """A point of the outline and what it stands for, half a cell on each side, is over what the body covers."""
    polygons = MonitorPolygons.of(robot, 0.01, 0.02)
    inset, steps = 0.75 * polygons.resolution, np.roll(polygons.outline, -1, axis=0) - polygons.outline
    assert np.hypot(*steps.T).max() <= polygons.resolution * (1 + 1e-9)
    assert np.hypot(*steps.T).min() > 0.5 * polygons.resolution, "no more points than needed"
    if len(polygons.corners):
        assert polygons.outline.max(axis=0) == pytest.approx(polygons.corners.max(axis=0) - inset)
        assert polygons.outline.min(axis=0) == pytest.approx(polygons.corners.min(axis=0) + inset)
    else:
        assert np.hypot(*polygons.outline.T) == pytest.approx(polygons.circumscribed - inset)


@pytest.mark.parametrize(("speed", "acceleration"), [(1.0, 0.5), (2.0, 0.5), (3.0, 0.5), (5.0, 1.0)])
def test_a_fast_robot_keeps_an_outline(speed: float, acceleration: float) -> None:
    """Its cells grow with its braking distance, but a body of a few cells would have no edge to look at."""
    polygons = MonitorPolygons.of(faster(speed, acceleration), 0.01, 0.02)
    assert polygons.limits.speed == speed
    assert polygons.resolution == pytest.approx(max(0.15 / 6, min(polygons.reach / 64, 0.15 / 3)))
    assert len(polygons.outline) >= 12 and np.hypot(*polygons.outline.T).min() > 0.1


def test_braking_takes_as_long_as_the_slower_of_both_motions() -> None:
    polygons, limits = MonitorPolygons.of(DISC, 0.01, 0.02), Limits.of(DISC)
    assert polygons.braking_time(-0.3, 0.0) == pytest.approx(0.3 / (0.6 * limits.acceleration))
    assert polygons.braking_time(0.0, -1.0) == pytest.approx(1.0 / (0.6 * limits.angular_acceleration))
    assert polygons.braking_time(0.3, 1.0) == polygons.braking_time(-0.3, 0.0)
    assert polygons.braking_time(0.01, 1.0) == polygons.braking_time(0.0, 1.0)


def test_the_fastest_point_of_the_body_is_a_corner() -> None:
    disc, rectangle = MonitorPolygons.of(DISC, 0.01, 0.02), MonitorPolygons.of(RECTANGLE, 0.01, 0.02)
    assert disc.body_speed(-0.3, 2.0) == 0.3, "a disc that turns does not move outwards"
    assert rectangle.body_speed(-0.2, -2.0) == pytest.approx(0.2 + 2.0 * RECTANGLE.circumscribed_radius)


def test_what_matters_lies_within_latency_and_braking() -> None:
    polygons = MonitorPolygons.of(DISC, 0.01, 0.02)
    distance = 0.2 * (0.1 + 0.2 / (0.6 * polygons.limits.acceleration))
    assert polygons.reach_of(0.2, 0.0, 0.1) == pytest.approx(DISC.circumscribed_radius + 0.02 + distance)
    assert polygons.reach_of(0.35, 0.0, 30.0) == polygons.reach


def test_a_triangle_and_a_short_side_are_outlined() -> None:
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.001]])
    points = outline_points(triangle, 0.0, 0.3)
    assert points[:5] == pytest.approx(
        np.array([[0.0, 0.0], [0.25, 0.0], [0.5, 0.0], [0.75, 0.0], [1.0, 0.0]])
    )
    assert points[-1] == pytest.approx(np.array([0.0, 0.001])) and len(points) == 9
    circle = outline_points(np.zeros((0, 2)), 0.5, 0.1)
    assert len(circle) == 32 and circle[0] == pytest.approx([-0.5, 0.0], abs=1e-12)


@given(st.floats(0.001, 100.0), st.floats(0.0, 0.5), st.floats(0.0, 5.0))
def test_the_safe_fraction_uses_all_the_free_time(free: float, latency: float, braking: float) -> None:
    """f T + f^2 t_b / 2 is the distance of a fraction of the twist in units of the whole twist's speed."""
    f = safe_fraction(free, latency, braking)
    distance = f * latency + f * f * braking / 2.0
    assert 0.0 < f <= 1.0 and distance <= free * (1 + 1e-6) + 1e-9
    assert f == 1.0 or distance >= free * (1 - 1e-6) - 1e-9


@pytest.mark.parametrize(
    ("free", "latency", "braking", "fraction"),
    [
        (0.0, 0.1, 1.0, 0.0),
        (0.0, 0.0, 1.0, 0.0),
        (0.0, 0.0, 0.0, 0.0),
        (-1.0, 0.1, 1.0, 0.0),
        (math.nan, 0.1, 1.0, 0.0),
        (math.inf, 0.1, 1.0, 1.0),
        (math.inf, 0.0, 0.0, 1.0),
        (0.05, 0.1, 0.0, 0.5),
        (0.5, 0.1, 0.0, 1.0),
        (0.05, 0.0, 0.0, 1.0),
        (0.25, 0.0, 2.0, 0.5),
        (0.5, 0.0, 0.25, 1.0),
    ],
)
def test_safe_fractions_worked_out_by_hand(
    free: float, latency: float, braking: float, fraction: float
) -> None:
    assert safe_fraction(free, latency, braking) == fraction


def test_creeping_harms_nobody() -> None:
    """The figure of the contacts that are allowed at all is 0.05 m/s."""
    assert 0.03 <= CREEP_SPEED < 0.05
