"""Solids and their mass: exact formulas against sampling, parts against the whole."""

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.outline import Outline, circle, points, rectangle
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.mass import link_mass_properties, robot_mass_properties, unloaded_mass
from chefbot.robot.geometry.outlines import base_plate_outline
from chefbot.robot.geometry.shapes import (
    AXES,
    Ball,
    Prism,
    mass_properties,
    rotation,
    transform_moments,
    volume,
    volume_moments,
)
from chefbot.robot.geometry.solids import link_origin, solids
from chefbot.robot.load import built_in_robots, load_robot

ROBOTS = {name: load_robot(name) for name in built_in_robots()}
sizes, places = st.floats(0.02, 0.5), st.floats(-1.0, 1.0)
angles = st.floats(-math.pi, math.pi)


def sampled(solid, samples=60_000):
    """Volume, mean and covariance of points that are thrown at the solid's box."""
    rng = np.random.default_rng(7)
    if isinstance(solid, Ball):
        box = rng.uniform(-solid.radius, solid.radius, (samples, 3))
        inside, size = np.linalg.norm(box, axis=1) <= solid.radius, (2 * solid.radius) ** 3
        return box[inside] + solid.at, size * inside.mean()
    edge = np.array(points(solid.outline.edge, 1e-5))
    low, high = edge.min(axis=0), edge.max(axis=0)
    flat = rng.uniform(low, high, (samples, 2))
    inside = in_polygon(flat, edge)
    for hole in solid.outline.holes:
        inside &= ~in_polygon(flat, np.array(points(hole, 1e-5)))
    along = rng.uniform(-0.5, 0.5, samples) * solid.length
    thrown = np.column_stack([flat, along])[inside] @ AXES[solid.axis].T + solid.at
    return thrown, float(np.prod(high - low)) * solid.length * inside.mean()


def in_polygon(thrown, loop):
    inside = np.zeros(len(thrown), dtype=bool)
    for (ax, ay), (bx, by) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
        crosses = (ay > thrown[:, 1]) != (by > thrown[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= crosses & (thrown[:, 0] < ax + (thrown[:, 1] - ay) / (by - ay) * (bx - ax))
    return inside


@st.composite
def some_solids(draw):
    at = (draw(places), draw(places), draw(places))
    if draw(st.booleans()):
        return Ball(draw(sizes), at)
    radius = draw(sizes)
    outline = draw(
        st.sampled_from(
            [
                Outline(circle(radius, 0.1, -0.2), (circle(0.4 * radius, 0.1 + 0.3 * radius, -0.2),)),
                Outline(
                    rectangle(radius, 2 * radius, 0.3, 0.1), (rectangle(0.2 * radius, radius, 0.3, 0.1),)
                ),
                Outline(circle(radius)),
            ]
        )
    )
    return Prism(outline, draw(sizes), draw(st.sampled_from("xyz")), at)


@settings(max_examples=25)
@given(some_solids())
@pytest.mark.slow
def test_exact_moments_equal_monte_carlo_integration(solid):
    exact = volume_moments(solid)
    thrown, filled = sampled(solid)
    assert filled == pytest.approx(exact.volume, rel=0.03)
    centre = exact.first / exact.volume
    about = exact.second / exact.volume - np.outer(centre, centre)
    deviation = np.sqrt(np.diag(about))
    assert np.all(np.abs(thrown.mean(axis=0) - centre) <= 0.03 * deviation)
    assert np.allclose(np.cov(thrown.T), about, atol=0.03 * deviation.max() ** 2)


@settings(max_examples=60)
@given(some_solids(), angles, angles, places, places, places)
def test_rotation_and_translation_keep_mass_and_inertia(solid, pitch, yaw, x, y, z):
    turn, shift = rotation(pitch, yaw), np.array([x, y, z])
    before = mass_properties([(volume_moments(solid), 500.0)])
    after = mass_properties([(transform_moments(volume_moments(solid), turn, shift), 500.0)])
    assert after.mass == pytest.approx(before.mass)
    assert after.centre == pytest.approx((turn @ before.centre + shift).tolist(), abs=1e-9)
    assert principal(after) == pytest.approx(principal(before), rel=1e-5)


def principal(properties):
    ixx, iyy, izz, ixy, ixz, iyz = properties.inertia
    tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    return np.linalg.eigvalsh(tensor).tolist()


def test_known_bodies_have_their_textbook_inertia():
    ball = mass_properties([(volume_moments(Ball(0.2)), 1000.0)])
    mass = 1000 * 4 / 3 * math.pi * 0.008
    assert ball.inertia == pytest.approx((*[0.4 * mass * 0.04] * 3, 0, 0, 0), abs=1e-12)
    wheel = mass_properties([(volume_moments(Prism(Outline(circle(0.1)), 0.02, "y")), 1000.0)])
    across = wheel.mass * (3 * 0.01 + 0.0004) / 12
    assert wheel.inertia == pytest.approx((across, wheel.mass * 0.005, across, 0, 0, 0), abs=1e-12)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_the_total_is_the_sum_of_its_parts(name):
    robot = ROBOTS[name]
    parts = solids(robot)
    assert len({part.name for part in parts}) == len(parts)
    assert unloaded_mass(robot) == pytest.approx(sum(part.mass for part in parts), rel=1e-12)
    moment = sum(
        part.mass * (np.array(part.inertia.centre) + link_origin(robot, part.link)) for part in parts
    )
    assert robot_mass_properties(robot).centre == pytest.approx(
        (moment / unloaded_mass(robot)).tolist(), abs=1e-12
    )
    links = {part.link for part in parts}
    assert sum(link_mass_properties(robot, link).mass for link in links) == pytest.approx(
        unloaded_mass(robot), rel=1e-12
    )
    for part in parts:
        assert part.mass > 0 and part.volume == pytest.approx(sum(map(volume, part.solids)))
        a, b, c = principal(part.inertia)
        assert a > 0 and a + b >= c * (1 - 1e-9)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_wheels_touch_the_floor_and_casters_hang_above_it(name):
    robot = ROBOTS[name]
    for side, sign in layout.SIDES.items():
        at = link_origin(robot, f"wheel_{side}_link")
        assert at == (0.0, sign * robot.wheels.separation / 2, robot.wheel_radius)
    for _, _, z in layout.caster_positions(robot).values():
        assert 0 < z - robot.casters.radius < 0.001


def test_symmetric_parts_have_a_centred_mass():
    """The Chefbot without what stands to one side."""
    robot = ROBOTS["chefbot"]
    places_ = msgspec.structs.replace(
        robot.places, driver=msgspec.structs.replace(robot.places.driver, x=0.0, y=0.0, plate=2)
    )
    imu = msgspec.structs.replace(
        robot.sensors.imu, mount=msgspec.structs.replace(robot.sensors.imu.mount, x=0.0, y=0.0)
    )
    sensors = msgspec.structs.replace(
        robot.sensors,
        imu=imu,
        depth_camera=None,
        ultrasonic=None,
        lidar=load_robot("chefbot_lidar").sensors.lidar,
    )
    even = msgspec.structs.replace(robot, places=places_, equipment=(), sensors=sensors)
    x, y, _ = robot_mass_properties(even).centre
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert robot_mass_properties(even).inertia[3:] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert robot_mass_properties(robot).centre[0] != pytest.approx(0.0, abs=1e-4)


def test_the_base_plate_is_the_disc_minus_notches_and_holes():
    """By the formula of the circular segment; the plate of the chapter."""
    robot = ROBOTS["chefbot"]
    radius, notch, plates = robot.body.radius, robot.plates.notch, robot.plates
    half = notch.length / 2
    beyond = radius**2 * math.asin(half / radius) + half * math.sqrt(radius**2 - half**2)
    cut = beyond - notch.length * (radius - notch.depth)
    holes = len(base_plate_outline(robot).holes) - 1
    assert holes == 4 + 4 + 8
    area = math.pi * (radius**2 - plates.centre_hole**2 / 4 - holes * plates.screw_hole**2 / 4) - 2 * cut
    assert base_plate_outline(robot).moments().area == pytest.approx(area, rel=1e-12)
