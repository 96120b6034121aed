"""The cost of people over time, and how the controller passes them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.dwa import DwaController
from chefbot.control.people_cost import NOBODY, PROXIMITY, NearbyPeople, person_cost
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

LIMITS = Limits.of(load_robot("chefbot"))
FLOOR = Costmap(np.zeros((160, 160), np.uint8), 0.05, -4.0, -4.0)
CONTACT = 0.43
METRES = st.floats(-3.0, 3.0)
VARIANCE = st.floats(0.0, 1.0)


def person(x: float, y: float, vx: float = 0.0, vy: float = 0.0, variance: float = 0.0) -> np.ndarray:
    return np.array([[x, y, vx, vy, variance, 0.0, 0.0]])


def cost(people: np.ndarray, x: float, y: float, time: float = 0.0) -> float:
    return person_cost(people, x, y, time, CONTACT, PROXIMITY)


@given(METRES, METRES, METRES, METRES, st.floats(0.0, 2.0), VARIANCE)
def test_the_cost_follows_a_person_and_is_a_fraction(
    x: float, y: float, vx: float, vy: float, time: float, variance: float
) -> None:
    moving = person(x, y, vx, vy, variance)
    there = cost(moving, x + vx * time, y + vy * time, time)
    assert there == pytest.approx(PROXIMITY**2 / (PROXIMITY**2 + variance))
    assert 0.0 <= cost(moving, 0.0, 0.0, time) <= there + 1e-12


@given(st.floats(0.0, 3.0), st.floats(0.01, 1.0), VARIANCE)
def test_the_cost_falls_with_the_distance(distance: float, more: float, variance: float) -> None:
    somebody = person(0.0, 0.0, variance=variance)
    assert cost(somebody, distance + more, 0.0) <= cost(somebody, distance, 0.0)


def test_a_third_of_the_cost_is_left_at_personal_space() -> None:
    assert cost(person(0.0, 0.0), CONTACT + 0.45, 0.0) == pytest.approx(1 / 3, abs=0.02)


def test_nobody_costs_nothing() -> None:
    assert cost(NOBODY.states, 0.0, 0.0) == 0.0


@given(METRES, METRES)
def test_states_are_converted_to_cells_of_the_costmap(x: float, y: float) -> None:
    nearby = NearbyPeople(person(x, y, 0.5, -0.5, 0.04), CONTACT)
    states = nearby.in_cells(SE2(0.0, 0.0, 0.0), 0.5, 1.5, FLOOR)
    assert states[0] == pytest.approx([(x + 4) * 20, (y + 4) * 20, 10.0, -10.0, 16.0, 0.0, 0.0])
    assert not len(NearbyPeople(person(x + 20.0, y), CONTACT).in_cells(SE2(0.0, 0.0, 0.0), 0.5, 1.5, FLOOR))


def drive_past(x: float, y: float, vx: float, vy: float, seconds: float, *, sees: bool) -> tuple[float, SE2]:
    """Drive along y = 0 past somebody: the smallest distance, and the pose at that moment."""
    dwa, pose, twist = DwaController(LIMITS), SE2(0.0, 0.0, 0.0), (0.0, 0.0)
    nearest = math.inf, pose
    line = np.arange(0.0, 3.5, 0.05)
    dwa.set_path(np.column_stack([line, 0.0 * line, 0.0 * line]))
    for tick in range(round(seconds / 0.1)):
        at = x + vx * tick * 0.1, y + vy * tick * 0.1
        people = NearbyPeople(person(*at, vx, vy, 0.01), CONTACT) if sees else NOBODY
        v, w, _ = dwa.command(pose, twist, FLOOR, people)
        dv, dw = LIMITS.acceleration * 0.1, LIMITS.angular_acceleration * 0.1
        twist = (
            float(np.clip(v, twist[0] - dv, twist[0] + dv)),
            float(np.clip(w, twist[1] - dw, twist[1] + dw)),
        )
        turn = SE2(0.0, 0.0, twist[1] * 0.05)
        pose = pose @ turn @ SE2(twist[0] * 0.1, 0.0, 0.0) @ turn
        nearest = min(nearest, (math.hypot(pose.x - at[0], pose.y - at[1]), pose), key=lambda one: one[0])
    return nearest


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_robot_lets_somebody_cross_and_passes_behind(side: float) -> None:
    crossing = 1.4, -1.6 * side, 0.0, 0.45 * side
    blind, _ = drive_past(*crossing, 6.0, sees=False)
    distance, pose = drive_past(*crossing, 6.0, sees=True)
    assert distance > max(blind + 0.1, CONTACT)
    assert pose.x < 1.4  # it was still behind the line on which the person walked


def test_the_robot_is_slower_towards_who_comes_towards_it() -> None:
    _, blind = drive_past(3.5, 0.1, -0.5, 0.0, 6.0, sees=False)
    _, seeing = drive_past(3.5, 0.1, -0.5, 0.0, 6.0, sees=True)
    assert seeing.x < 0.85 * blind.x
