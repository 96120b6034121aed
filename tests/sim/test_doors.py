"""Tests doors without the rest of the simulation."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.buildings.world_file import Door
from chefbot.sim.world.doors import GAP, SPEED, MovingDoor
from chefbot.sim.world.shapes import clearance

FAR = (50.0, 50.0, 0.2)


def door(kind: str = "hinge", opened: float = 1.0) -> MovingDoor:
    return MovingDoor(Door(name="door", x=0.0, y=0.0, yaw=0.0, width=0.9, kind=kind, open=opened))  # type: ignore[arg-type]


@given(st.sampled_from(["hinge", "slide"]), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_door_reaches_its_target_at_the_given_speed(kind: str, start: float, target: float) -> None:
    moving = door(kind, start)
    moving.target = target
    steps = 0
    while moving.moving:
        assert moving.advance(0.1, [FAR])
        steps += 1
    assert moving.open == target
    assert steps == pytest.approx(abs(target - start) / (0.1 * SPEED), abs=1.01)
    assert not moving.advance(0.1, [])


def test_a_target_within_one_step_is_reached_exactly() -> None:
    start, target = 0.005374569764496049, 0.042371686846861635
    assert start + (target - start) != target, "the sum of the floats misses it"
    one = door("hinge", start)
    one.target = target
    assert one.advance(0.1, [FAR]) and not one.moving
    assert one.open == target


@given(st.floats(0.1, 0.8), st.floats(0.05, 0.3))
@settings(max_examples=25)
def test_a_door_stops_before_it_hits_a_person(x: float, radius: float) -> None:
    closing = door()
    closing.target = 0.0
    person = (x, 0.3, radius)
    free = clearance([closing.shape], x, 0.3, -math.inf, math.inf) >= radius + GAP
    for _ in range(60):
        closing.advance(0.05, [person])
        if free:
            assert clearance([closing.shape], x, 0.3, -math.inf, math.inf) >= radius + GAP - 1e-9
    if free and radius > 0.3 - GAP:
        assert closing.moving, "the closed leaf would overlap the person"
