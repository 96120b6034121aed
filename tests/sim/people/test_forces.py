"""Tests the social forces: against the papers' formulas, and what they have in common."""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point

from chefbot.sim.people.distance_field import lower_to_boxes
from chefbot.sim.people.forces import (
    BEHIND_WEIGHT,
    FAINT_RANGES,
    FAINT_WALL_DISTANCE,
    INTERACTION_DISTANCE,
    RELAXATION,
    SIGHT_STEPS,
    STRENGTH,
    WALL_STRENGTH,
    driving_force,
    force_of_group,
    force_of_movers,
    force_of_people,
    force_of_robot,
    force_of_walls,
    interaction,
    is_faint,
    look_at_each_other,
    nearest_on_leaf,
    weight_of_view,
)
from chefbot.sim.people.walkers import Surroundings, walkers_at

LAMBDA, GAMMA, N_SLOW, N_TURN, A = 2.0, 0.35, 3.0, 2.0, 4.5
"""Parameters that Moussaid et al. 2009 measured; A in m/s^2."""
OFFSET, SPEED = st.floats(-4.0, 4.0), st.floats(-2.0, 2.0)
FRAME = np.array([0.0, 0.0, 0.05])
RADIUS = 0.22


def measured(d: complex, v: complex) -> complex:
    """Return the acceleration by Moussaid et al. 2009, equations (1) to (4), with complex numbers as vectors.

    d: vector to the other. v: own velocity minus that of the other.
    """
    e = d / abs(d)
    interaction_vector = LAMBDA * v + e
    t = interaction_vector / abs(interaction_vector)
    theta, reach = cmath.phase(e / t), GAMMA * abs(interaction_vector)
    slow = A * math.exp(-abs(d) / reach - (N_SLOW * reach * theta) ** 2)
    turn = A * math.exp(-abs(d) / reach - (N_TURN * reach * theta) ** 2)
    return -slow * t - math.copysign(turn, theta) * 1j * t


def room(width: float = 4.0, boxes=()) -> np.ndarray:
    """Return the field of a room of `width` by 4 m from (0, 0), with boxes (x, y, half sides)."""
    field = np.full((80, round(width / 0.05)), 1.5, np.float32)
    walls = [(0.5 * width, 0.0, 0.5 * width, 0.0), (0.5 * width, 4.0, 0.5 * width, 0.0)]
    walls += [(0.0, 2.0, 0.0, 2.0), (width, 2.0, 0.0, 2.0), *boxes]
    lower_to_boxes(field, FRAME, np.array([(*wall, 1.0, 0.0, 0.0) for wall in walls]), 1.5)
    return field


def rotated(pairs, angle: float) -> np.ndarray:
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    return np.array(pairs, float) @ turn


@settings(max_examples=40)
@given(OFFSET, OFFSET, SPEED, SPEED)
def test_two_people_react_as_was_measured(dx, dy, vx, vy) -> None:
    d, v = complex(dx, dy), complex(vx, vy)
    assume(abs(d) > 0.1)
    assume(
        abs(LAMBDA * v + d / abs(d)) > 1e-3
        and abs(abs(cmath.phase((LAMBDA * v + d / abs(d)) / d)) - math.pi) > 1e-3
    )
    assume(abs(cmath.phase(d / (LAMBDA * v + d / abs(d)))) > 1e-3)
    assert complex(*interaction(dx, dy, vx, vy)) == pytest.approx(measured(d, v), abs=2e-3)


@settings(max_examples=40)
@given(OFFSET, OFFSET, SPEED, SPEED, st.floats(-math.pi, math.pi))
def test_a_reaction_turns_with_the_scene_and_is_bounded(dx, dy, vx, vy, angle: float) -> None:
    d, v = rotated([(dx, dy), (vx, vy)], angle)
    force, turned = interaction(dx, dy, vx, vy), interaction(*d, *v)
    assert math.hypot(*force) <= math.sqrt(2.0) * STRENGTH + 1e-9
    t = (LAMBDA * complex(vx, vy)) + complex(dx, dy) / max(math.hypot(dx, dy), 1e-6)
    if math.hypot(dx, dy) > 0.1 and abs(t) > 0.1 and abs((complex(dx, dy) / t).imag) > 1e-3:
        assert turned == pytest.approx(rotated([force], angle)[0], abs=1e-3)


def test_who_meets_head_on_evades_to_one_side_early() -> None:
    forces = [interaction(d, 0.0, 2.0, 0.0) for d in (3.5, 2.5, 1.5, 0.5)]
    assert all(fx < 0.0 and fy < 0.0 for fx, fy in forces), "slows down, and evades to the right"
    strengths = [math.hypot(*force) for force in forces]
    assert strengths == sorted(strengths)


def test_who_walks_away_is_hardly_felt() -> None:
    towards, away = (math.hypot(*interaction(1.5, 0.0, v, 0.0)) for v in (1.5, -0.4))
    assert away < 0.05 * towards


@settings(max_examples=60)
@given(OFFSET, OFFSET, SPEED, SPEED)
def test_what_is_faint_near_by_is_a_fiftieth_of_the_strength(dx, dy, vx, vy) -> None:
    distance = math.hypot(dx, dy)
    if distance > INTERACTION_DISTANCE:
        assert is_faint(dx, dy, vx, vy)
    elif is_faint(dx, dy, vx, vy):
        assert math.hypot(*interaction(dx, dy, vx, vy)) <= 0.02 * math.sqrt(2.0) * STRENGTH
    elif distance > 0.01:
        reach = GAMMA * abs(LAMBDA * complex(vx, vy) + complex(dx, dy) / distance)
        assert distance <= FAINT_RANGES * reach + 1e-6


def test_people_in_one_place_are_never_faint() -> None:
    assert not is_faint(0.0, 0.0, 0.0, 0.0)
    assert all(math.isfinite(part) for part in interaction(0.0, 0.0, 0.0, 0.0))
    assert interaction(1.0, 0.0, -0.5, 0.0) == (0.0, 0.0), "the interaction vector vanishes"


@pytest.mark.parametrize(
    ("degrees", "weight"), [(0, 1.0), (90, 1.0), (99, 1.0), (101, BEHIND_WEIGHT), (180, BEHIND_WEIGHT)]
)
@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_what_is_behind_counts_half(degrees: float, weight: float, heading: float) -> None:
    for side in (-1.0, 1.0):
        angle = heading + side * math.radians(degrees)
        at = 3.0 * math.cos(angle), 3.0 * math.sin(angle)
        assert weight_of_view(math.cos(heading), math.sin(heading), *at) == weight


def test_the_force_of_people_is_the_sum_of_those_seen() -> None:
    position = np.array([[0.0, 0.0], [1.0, 0.1], [-1.0, 0.2], [0.5, 1.0], [9.0, 0.0]])
    velocity, heading = np.zeros((5, 2)), np.tile([1.0, 0.0], (5, 1))
    velocity[0], velocity[1] = (1.0, 0.0), (-0.5, 0.0)
    sees = np.ones((5, 5), np.bool_)
    np.fill_diagonal(sees, False)
    sees[0, 3] = False
    expected = np.array(interaction(1.0, 0.1, 1.5, 0.0)) + BEHIND_WEIGHT * np.array(
        interaction(-1.0, 0.2, 1.0, 0.0)
    )
    assert force_of_people(position, velocity, heading, sees, 0) == pytest.approx(
        expected, rel=0.02, abs=0.02
    )
    sees[0] = False
    assert force_of_people(position, velocity, heading, sees, 0) == (0.0, 0.0)


def robot_force(seen, sight: float = 3.0, boxes=(), at=(1.0, 2.0)) -> tuple[float, float]:
    """Return the force on somebody who stands and looks along x, by a robot (x, y, vx, vy)."""
    w = walkers_at(np.array([at]), np.array([[1.0, 0.0]]))
    none, costs = np.zeros((0, 4)), np.zeros((1, 2, 2), np.int32)
    s = Surroundings(
        room(boxes=boxes),
        FRAME,
        costs,
        FRAME,
        none,
        np.zeros((0, 3)),
        np.zeros(3),
        np.array(seen, float),
        sight,
    )
    return force_of_robot(w, s, 0)


def test_a_robot_that_is_seen_is_felt_as_a_person_is() -> None:
    assert robot_force((2.0, 2.1, -0.5, 0.0)) == pytest.approx(interaction(1.0, 0.1, 0.5, 0.0))
    behind = np.array(interaction(-0.6, 0.1, -0.5, 0.0))
    assert robot_force((0.4, 2.1, 0.5, 0.0)) == pytest.approx(BEHIND_WEIGHT * behind)


def test_a_robot_out_of_sight_is_not_felt() -> None:
    assert robot_force((2.0, 2.1, -0.5, 0.0), sight=0.9) == (0.0, 0.0)
    assert robot_force((2.0, 2.1, -0.5, 0.0), boxes=[(1.5, 2.0, 0.1, 0.5)]) == (0.0, 0.0)
    assert robot_force((2.0, 2.1, -0.5, 0.0)) != (0.0, 0.0)


@pytest.mark.parametrize("side", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_walls_push_away_the_more_the_nearer(side) -> None:
    field, pushes = room(), []
    for gap in (0.05, 0.1, 0.2, 0.4, 0.55):
        x, y = (2.0 - (2.0 - RADIUS - gap) * part for part in side)
        fx, fy = force_of_walls(field, FRAME, x, y, RADIUS)
        pushes.append(fx * side[0] + fy * side[1])
        assert pushes[-1] == pytest.approx(WALL_STRENGTH * math.exp(-gap / 0.1), rel=0.05)
        assert abs(fx * side[1]) + abs(fy * side[0]) < 0.05 * pushes[-1]
    assert pushes == sorted(pushes, reverse=True)


def test_walls_are_bounded_and_not_felt_from_afar() -> None:
    assert force_of_walls(room(), FRAME, RADIUS + FAINT_WALL_DISTANCE + 0.1, 2.0, RADIUS) == (0.0, 0.0)
    assert math.hypot(*force_of_walls(room(), FRAME, 0.1, 2.0, RADIUS)) == pytest.approx(WALL_STRENGTH)


LEAF = st.tuples(*[st.floats(-2.0, 2.0)] * 4)


@settings(max_examples=40)
@given(LEAF, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_the_nearest_point_of_a_leaf_is_on_it(leaf, x: float, y: float) -> None:
    assume(math.dist(leaf[:2], leaf[2:]) > 1e-3)
    line = LineString([leaf[:2], leaf[2:]])
    at = nearest_on_leaf(np.array([leaf]), 0, x, y)
    assert line.distance(Point(at)) < 1e-6
    assert math.dist(at, (x, y)) == pytest.approx(line.distance(Point(x, y)), abs=1e-6)


def test_leaves_and_chairs_push_away_and_add_up() -> None:
    leaves, discs = np.array([[0.0, 0.0, 1.0, 0.0]]), np.array([[0.5, 1.0, 0.25]])
    none = np.zeros((0, 4)), np.zeros((0, 3))
    leaf = force_of_movers(leaves, none[1], 0.5, 0.4, RADIUS)
    chair = force_of_movers(none[0], discs, 0.5, 0.4, RADIUS)
    assert leaf == pytest.approx((0.0, WALL_STRENGTH * math.exp(-(0.4 - RADIUS) / 0.1)), abs=1e-3)
    assert chair == pytest.approx((0.0, -WALL_STRENGTH * math.exp(-(0.6 - RADIUS - 0.25) / 0.1)), abs=1e-3)
    assert force_of_movers(leaves, discs, 0.5, 0.4, RADIUS) == pytest.approx(np.add(leaf, chair))
    assert force_of_movers(leaves, discs, 0.5, -0.9, RADIUS) == (0.0, 0.0), "too far from both"
    assert force_of_movers(leaves, none[1], 0.5, 0.0, RADIUS) == (0.0, 0.0), "on the leaf no side is away"


def group_force(others, velocity=(0.0, 0.0), heading=(1.0, 0.0), groups=None) -> np.ndarray:
    """Return the force on somebody at (0, 0) in a group with people at points."""
    position = np.array([(0.0, 0.0), *others])
    n = len(position)
    moving, looking = np.zeros((n, 2)), np.tile(np.array(heading, float), (n, 1))
    moving[0] = velocity
    group = np.zeros(n, np.int64) if groups is None else np.array(groups)
    return np.array(force_of_group(position, moving, looking, group, 0))


def test_who_is_alone_has_no_group() -> None:
    assert not group_force([]).any()
    assert not group_force([(3.0, 0.0), (0.2, 0.0)], groups=[4, -1, 5]).any()


@pytest.mark.parametrize(("gap", "force"), [(0.5, -1.0), (0.79, -1.0), (0.9, 0.0), (1.05, 3.0), (3.0, 3.0)])
def test_a_pair_keeps_a_little_space_and_no_more(gap: float, force: float) -> None:
    assert group_force([(gap, 0.0)]) == pytest.approx((force, 0.0))
    assert group_force([(0.0, gap)]) == pytest.approx((0.0, force), abs=1e-9)


def test_who_turns_the_head_to_the_others_slows_down() -> None:
    assert not group_force([(0.9, 0.0)], velocity=(1.0, 0.0)).any()
    assert not group_force([(0.0, 0.9)], velocity=(1.0, 0.0)).any(), "beside"
    behind = group_force([(-0.9, 0.0)], velocity=(1.0, 0.5))
    assert behind == pytest.approx(-4.0 * (math.pi / 2) * np.array([1.0, 0.5]), rel=1e-4)
    oblique = group_force([(-0.6, 0.6)], velocity=(1.0, 0.0))
    assert oblique == pytest.approx((-4.0 * math.pi / 4, 0.0), rel=1e-3)


def test_larger_groups_spread_more() -> None:
    near, far = [(0.9, 0.9), (0.9, -0.9)], [(2.5, 0.5), (2.5, -0.5)]
    assert not group_force(near).any(), "the centre is 0.6 m ahead, and may be 1 m away"
    assert group_force(far) == pytest.approx((3.0, 0.0))


@given(SPEED, SPEED, st.floats(-math.pi, math.pi), st.floats(0.0, 2.0))
@settings(max_examples=30)
def test_people_reach_their_speed_in_the_relaxation_time(vx, vy, bearing: float, speed: float) -> None:
    ex, ey = math.cos(bearing), math.sin(bearing)
    ax, ay = driving_force(vx, vy, ex, ey, speed)
    assert (vx + RELAXATION * ax, vy + RELAXATION * ay) == pytest.approx((speed * ex, speed * ey), abs=1e-9)


@pytest.mark.parametrize("count", [2, 7, 13, 30])
def test_in_twelve_steps_all_look_at_each_other_once(count: int) -> None:
    position, looked = np.arange(count)[:, None] * np.array([[50.0, 0.0]]), []
    for number in range(5, 5 + SIGHT_STEPS):
        sees = np.ones((count, count), np.bool_)
        look_at_each_other(position, room(), FRAME, number, sees)
        assert np.array_equal(sees, sees.T)
        looked += [pair for pair in itertools.combinations(range(count), 2) if not sees[pair]]
    assert sorted(looked) == list(itertools.combinations(range(count), 2))


def test_nobody_is_seen_through_a_wall_or_from_afar() -> None:
    position = np.array([[0.5, 2.0], [3.5, 2.0], [0.5, 3.5], [7.5, 2.0]])
    sees = np.zeros((4, 4), np.bool_)
    for number in range(SIGHT_STEPS):
        look_at_each_other(position, room(8.0, [(2.0, 1.5, 0.1, 1.5)]), FRAME, number, sees)
    pairs = [pair for pair in itertools.combinations(range(4), 2) if sees[pair]]
    assert pairs == [(0, 2)]
