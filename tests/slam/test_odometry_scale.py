"""Tests what a mapper learns about the noise of odometry, and that the particles use it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.support.beam_angles import LIDAR

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.slam import Gmapping, GmappingParams
from chefbot.slam.odometry_scale import OdometryScale

MOTION, VARIANCE = np.array([0.5, 0.0, 0.1]), np.array([0.05, 0.02, 0.1]) ** 2
CERTAIN = np.ones(3)


def learned(errors: np.ndarray, systematic_steps: float, motions: np.ndarray | None = None) -> np.ndarray:
    """Return the factors after matches that correct odometry by errors (n, 3) in units of what is assumed."""
    scale = OdometryScale(0.05, systematic_steps)
    motions = np.tile(MOTION, (len(errors), 1)) if motions is None else motions
    for motion, error in zip(motions, errors, strict=True):
        scale.observe(motion, motion - error * np.sqrt(VARIANCE), VARIANCE, CERTAIN)
    return scale.factors


def test_random_errors_do_not_count_as_systematic() -> None:
    errors = np.random.default_rng(3).normal(size=(1500, 3)) * 0.6
    assert learned(errors, 20.0) == pytest.approx(learned(errors, 0.0), abs=0.15)
    assert learned(errors, 20.0) == pytest.approx(np.full(3, 0.36), abs=0.2)


def test_a_systematic_error_adds_up_over_the_steps() -> None:
    errors = np.tile([0.3, 0.0, 0.2], (1500, 1))
    # n steps of 0.3 deviations each are 0.3 n: as far as n steps of a variance of 0.09 n spread
    assert learned(errors, 20.0) == pytest.approx([21 * 0.09, 21 * 0.09, 21 * 0.04], rel=0.35)


def test_odometry_that_is_too_long_is_so_forwards_and_backwards() -> None:
    signs = np.where(np.arange(1500) % 2, 1.0, -1.0)[:, None]
    errors, motions = signs * [0.3, 0.0, 0.0], signs * [0.5, 0.0, 0.0]
    same = np.tile([0.3, 0.0, 0.0], (1500, 1))
    assert learned(errors, 20.0, motions)[0] == pytest.approx(learned(same, 20.0)[0])


@settings(max_examples=30)
@given(
    st.lists(st.tuples(*[st.floats(-20.0, 20.0)] * 3, *[st.floats(0.0, 1.0)] * 3), min_size=1, max_size=40)
)
def test_factors_are_bounded_and_equal_along_and_across(history) -> None:
    scale = OdometryScale(0.1, 20.0)
    for *error, a, b, c in history:
        scale.observe(MOTION, MOTION - np.array(error), VARIANCE, np.array([a, b, c]))
        assert np.all((scale.factors >= 0.1) & (scale.factors <= 4.0))
        assert scale.factors[0] == scale.factors[1]


def room_then_corridor() -> list[SE2]:
    """Return poses of two laps about the cupboard in the room, and of 20 m along the corridor."""
    corners = [(1.2, 1.2), (4.8, 1.2), (4.8, 4.8), (1.2, 4.8)] * 2 + [
        (1.2, 1.2),
        (4.8, 1.2),
        (4.8, 3.0),
        (25.0, 3.0),
    ]
    poses, yaw = [], 0.0
    for (ax, ay), (bx, by) in pairwise(corners):
        length, heading = math.hypot(bx - ax, by - ay), math.atan2(by - ay, bx - ax)
        turns = np.linspace(0.0, wrap(heading - yaw), 8)
        poses += [SE2(ax, ay, yaw + turn) for turn in turns]
        poses += [
            SE2(ax + (bx - ax) * s, ay + (by - ay) * s, heading) for s in np.arange(0.1, length, 0.1) / length
        ]
        yaw = heading
    return poses


def largest_error(world, seed: int) -> float:
    """Return the largest error of the position in m over the drive with true odometry."""
    truth, noise = room_then_corridor(), np.random.default_rng(9)
    slam, errors = Gmapping(GmappingParams(particles=15, seed=seed)), []
    for pose in truth:
        ranges = world.ranges(pose, LIDAR, 6.0)
        slam.update(LIDAR, ranges + noise.normal(0, 0.01, len(ranges)).astype(np.float32), pose)
        errors.append(truth[0].between(pose).distance(slam.pose))
    return max(errors)


def test_after_a_room_a_bare_corridor_keeps_its_length(room_and_corridor) -> None:
    """The room shows that odometry is right; in the corridor only odometry measures the way."""
    assert np.median([largest_error(room_and_corridor, seed) for seed in range(1, 6)]) < 0.28


@pytest.mark.parametrize("particles", [1, 2])
def test_few_particles_map_the_room_all_the_same(room_and_corridor, particles: int) -> None:
    slam = Gmapping(GmappingParams(particles=particles))
    for pose in room_then_corridor()[:100]:
        slam.update(LIDAR, room_and_corridor.ranges(pose, LIDAR, 6.0), pose)
    assert room_then_corridor()[0].between(room_then_corridor()[99]).distance(slam.pose) < 0.1
