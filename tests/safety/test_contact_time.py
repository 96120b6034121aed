"""The closed form of the time until contact, against the robot moved in small steps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.robot.load import load_robot
from chefbot.safety.contact_time import disc_contact, distance_from_body, first_contact, polygon_contact

RADIUS = 0.15
POLYGON = load_robot("jackal").footprint.polygon()
STEP = 2e-3
HORIZON = 4.0


def points_in_base(x: float, y: float, v: float, w: float) -> NDArray[np.float64]:
    """Return the positions (n, 2) of a point in base_link at each step of the robot's motion."""
    t = np.arange(0.0, HORIZON, STEP)
    yaw, chord = w * t, v * t * np.sinc(w * t / 2 / math.pi)
    dx, dy = x - chord * np.cos(yaw / 2), y - chord * np.sin(yaw / 2)
    return np.column_stack([np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx])


def inside(points: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    edges = np.roll(corners, -1, axis=0) - corners
    rel = points[:, None, :] - corners[None]
    return np.asarray((edges[None, :, 0] * rel[..., 1] - edges[None, :, 1] * rel[..., 0] >= 0.0).all(axis=1))


def first_step(met: NDArray[np.bool_]) -> float:
    return float(np.argmax(met)) * STEP if met.any() else math.inf


@pytest.mark.parametrize("seed", range(20))
def test_closed_form_agrees_with_small_steps(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(60):
        v, w = rng.uniform(-1.0, 1.0), float(rng.choice([0.0, 1e-9, rng.uniform(-2.0, 2.0)]))
        x, y = rng.uniform(-1.5, 1.5, 2)
        path = points_in_base(x, y, v, w)
        for inner, outer, found in (
            (
                np.hypot(*path.T) < RADIUS - 0.003,
                np.hypot(*path.T) < RADIUS + 0.003,
                disc_contact(x, y, v, w, RADIUS),
            ),
            (
                inside(path, POLYGON * 0.985),
                inside(path, POLYGON * 1.015),
                polygon_contact(x, y, v, w, POLYGON),
            ),
        ):
            if outer[0] or found > HORIZON - 0.1:
                assert outer[0] or first_step(inner) > HORIZON - 0.2
                continue
            # between the contacts of a slightly larger and a slightly smaller body
            assert first_step(outer) - 2 * STEP <= found <= first_step(inner) + 2 * STEP


def test_a_body_in_contact_may_leave_but_not_press() -> None:
    for x, y in ((0.149, 0.0), (0.1, 0.1)):
        assert disc_contact(x, y, 0.2, 0.0, RADIUS) == 0.0
        assert disc_contact(x, y, -0.2, 0.0, RADIUS) == math.inf
        assert disc_contact(x, y, 0.0, 1.0, RADIUS) == math.inf, "a disc rotates in place in contact"
    front = float(POLYGON[:, 0].max())
    assert polygon_contact(front - 0.001, 0.0, 0.2, 0.0, POLYGON) == 0.0
    assert polygon_contact(front - 0.001, 0.0, -0.2, 0.0, POLYGON) == math.inf


def test_the_corner_of_a_rectangle_turns_into_a_point_beside_it() -> None:
    reach = math.hypot(POLYGON[:, 0].max(), POLYGON[:, 1].max()) - 0.01
    beside = POLYGON[:, 1].max() + 0.02
    assert polygon_contact(0.0, beside, 0.0, 1.0, POLYGON) < math.inf
    assert polygon_contact(0.0, reach + 0.02, 0.0, 1.0, POLYGON) == math.inf
    assert polygon_contact(0.0, beside, 1.0, 0.0, POLYGON) == math.inf, "it drives along the wall"


def test_first_contact_is_the_nearest_and_no_own_part() -> None:
    points = np.array([[1.0, 0.0], [0.5, 0.05], [0.02, 0.0]])
    time, index = first_contact(points, 0.5, 0.0, RADIUS, np.zeros((0, 2)), RADIUS)
    assert index == 1 and 0.6 < time < 0.75
    assert first_contact(points, -0.5, 0.0, RADIUS, np.zeros((0, 2)), RADIUS) == (math.inf, -1)
    assert first_contact(points[:0], 0.5, 0.0, RADIUS, np.zeros((0, 2)), RADIUS) == (math.inf, -1)


def test_distance_from_a_disc_and_from_a_rectangle() -> None:
    assert distance_from_body(0.3, 0.4, RADIUS, np.zeros((0, 2))) == pytest.approx(0.35)
    front, side = POLYGON.max(axis=0)
    assert distance_from_body(front + 0.3, side + 0.4, 0.0, POLYGON) == pytest.approx(0.5)
    assert distance_from_body(0.0, side + 0.1, 0.0, POLYGON) == pytest.approx(0.1)
    assert distance_from_body(0.0, 0.0, 0.0, POLYGON) < 0.0
