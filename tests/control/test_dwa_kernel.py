"""The compiled rollout and scoring of the dynamic window against plain formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.dwa_kernel import cost_at, nearest_on_path, roll_out, score_twists
from chefbot.control.dwa_params import DwaParams
from chefbot.control.people_cost import NOBODY
from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN

FREE = np.zeros((200, 200), np.uint8)
SPEEDS = st.floats(0.0, 10.0)
TURNS = st.floats(-2.0, 2.0)
PARAMS = DwaParams()
WEIGHTS = np.array(
    [
        PARAMS.path_weight,
        PARAMS.goal_weight,
        PARAMS.heading_weight,
        PARAMS.obstacle_weight,
        PARAMS.change_weight,
        PARAMS.people_weight,
    ]
)
NO_CORNERS = np.zeros((0, 2))
"""The footprint of a disc."""
NO_PEOPLE = NOBODY.states, (8.0, 6.0)
"""Nobody, and the distances of `person_cost`, in cells."""
SAMPLES = np.array([[v, w] for v in (0.0, 0.2, 0.4) for w in np.linspace(-1.0, 1.0, 9)])


def chosen(cells: np.ndarray, v: float = 0.4, y: float = 5.0) -> int:
    """The index of the best twist, -1 if none is admissible."""
    scores = scores_of(cells, v, y)
    return int(np.argmin(scores)) if np.isfinite(scores).any() else -1


def scores_of(cells: np.ndarray, v: float = 0.4, y: float = 5.0) -> np.ndarray:
    path = np.column_stack([np.arange(2.0, 8.0, 0.05), np.full(120, 5.0), np.zeros(120)])
    pose, twist, limits = np.array([3.0, y, 0.0]), np.array([v, 0.0]), np.array([0.5, 2.0])
    return score_twists(
        cells,
        0.05,
        pose,
        SAMPLES,
        twist,
        path,
        10.0,
        1.5,
        0.1,
        limits,
        0.4,
        (PARAMS.slowing, PARAMS.people_slowing),
        WEIGHTS,
        NO_CORNERS,
        NOBODY.states,
        0.4,
    )


@given(st.floats(-3.0, 8.0), st.floats(-3.0, 8.0))
def test_cost_is_zero_outside_and_in_unknown_cells(column: float, row: float) -> None:
    cells = np.arange(20, dtype=np.uint8).reshape(4, 5)
    cells[2, 3] = UNKNOWN
    r, c = math.floor(row), math.floor(column)
    inside = 0 <= r < 4 and 0 <= c < 5
    expected = 0 if not inside or (r, c) == (2, 3) else int(cells[r, c])
    assert cost_at(cells, column, row) == expected


@given(SPEEDS, TURNS, st.floats(-3.0, 3.0))
def test_a_constant_twist_rolls_out_to_its_exact_arc(v: float, w: float, yaw: float) -> None:
    end = 1.5
    end_of = roll_out(
        FREE, 100.0, 100.0, yaw, (v, w), (v, w), 0.0, end, 1e9, INSCRIBED, NO_CORNERS, 0, 0.0, *NO_PEOPLE
    )
    chord = v * end * np.sinc(w * end / 2 / math.pi)
    mean = yaw + w * end / 2
    assert end_of[:2] == pytest.approx((100 + chord * math.cos(mean), 100 + chord * math.sin(mean)), abs=1e-6)
    assert end_of[2:5] == pytest.approx((yaw + w * end, v * end, end))
    assert end_of[5:] == (0.0, 0, 0.0, 0.0, False, 0.0)


@given(SPEEDS, SPEEDS, st.floats(0.01, 3.0))
def test_a_ramp_covers_the_integral_of_its_speed(v0: float, v1: float, ramp: float) -> None:
    end, count = 1.5, 20
    distance = roll_out(
        FREE,
        50.0,
        100.0,
        0.0,
        (v0, 0.0),
        (v1, 0.0),
        ramp,
        end,
        1e9,
        INSCRIBED,
        NO_CORNERS,
        0,
        0.0,
        *NO_PEOPLE,
    ).distance
    middles = (np.arange(count) + 0.5) * end / count
    expected = np.sum(v0 + np.minimum(1.0, middles / ramp) * (v1 - v0)) * end / count
    assert distance == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(st.integers(5, 60), st.floats(1.0, 12.0))
def test_a_rollout_ends_before_a_wall(gap: int, speed: float) -> None:
    cells = FREE.copy()
    cells[:, 100 + gap] = LETHAL
    end = roll_out(
        cells,
        100.5,
        100.5,
        0.0,
        (speed, 0),
        (speed, 0),
        0.0,
        8.0,
        1e9,
        INSCRIBED,
        NO_CORNERS,
        0,
        0.0,
        *NO_PEOPLE,
    )
    assert cost_at(cells, end.x, 100.5) == 0
    assert end.blocked == (speed * 8.0 >= gap - 0.5 + 1e-9) or abs(speed * 8.0 - gap + 0.5) < 1e-6


@given(st.floats(1.0, 10.0), st.floats(0.1, 5.0))
def test_a_rollout_ends_at_the_goal(speed: float, remaining: float) -> None:
    end = roll_out(
        FREE,
        50.0,
        50.0,
        0.0,
        (speed, 0.0),
        (speed, 0.0),
        0.0,
        5.0,
        remaining,
        INSCRIBED,
        NO_CORNERS,
        0,
        0.0,
        *NO_PEOPLE,
    )
    assert remaining <= end.distance < remaining + speed * 0.0751
    assert end.time == pytest.approx(end.distance / speed)


@given(st.integers(0, 2**32 - 1))
def test_nearest_path_pose_equals_the_argmin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path, (x, y) = rng.normal(size=(30, 3)), rng.normal(size=2)
    squared = ((path[:, :2] - (x, y)) ** 2).sum(axis=1)
    index, found = nearest_on_path(path, x, y)
    assert (index, found) == (squared.argmin(), pytest.approx(squared.min()))


def test_on_the_path_the_robot_drives_straight_at_full_speed() -> None:
    assert tuple(SAMPLES[chosen(FREE)]) == (0.4, 0.0)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_beside_the_path_the_robot_steers_back(side: float) -> None:
    assert SAMPLES[chosen(FREE, y=5.0 + 0.3 * side)][1] * side < 0.0


def test_no_twist_is_admissible_that_cannot_stop_in_time() -> None:
    cells = FREE.copy()
    cells[:, 61:] = LETHAL
    assert chosen(cells) == -1, "even braking ends at the wall"
    assert SAMPLES[chosen(cells, v=0.0)][0] == 0.0, "a standing robot may rotate in place"


def test_twists_within_the_inscribed_zone_must_leave_it() -> None:
    cells = FREE.copy()
    cells[:, :] = INSCRIBED
    assert SAMPLES[chosen(cells, v=0.0)][0] == 0.0
    cells[:, 62:] = 0
    assert SAMPLES[chosen(cells, v=0.4)][0] > 0.0


@pytest.mark.parametrize("side", [-1, 1])
def test_a_robot_beside_an_obstacle_leaves_by_the_widest_way(side: int) -> None:
    """As beside the corner of a desk along which the path leads: all costs within the inscribed radius are equal."""
    cells = FREE.copy()
    cells[96:104, 50:64] = INSCRIBED
    rows = slice(103, 106) if side > 0 else slice(94, 97)
    cells[rows, 62:65] = LETHAL
    v, w = SAMPLES[chosen(cells, v=0.0)]
    assert v > 0.0 and w * side < 0.0, "it turns away while it drives"


def test_high_costs_limit_the_speed() -> None:
    cells = np.full((200, 200), 252, np.uint8)
    assert SAMPLES[chosen(cells)][0] == 0.2
