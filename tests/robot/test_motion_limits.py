"""Motion limits of the robot that limit every twist, against figures worked out by hand."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import (
    Limits,
    contact_speed,
    max_acceleration,
    max_deceleration,
    max_speed,
    max_turn,
    max_turn_acceleration,
    max_turn_deceleration,
    max_wheel_speed,
    no_load_wheel_speed,
    one_plane_warning,
    rolling_torque,
    turn_rate_on_spot,
)
from chefbot.robot.spec import GRAVITY, Robot
from chefbot.robot.validation import check_buildable

CHEFBOT, JACKAL = load_robot("chefbot"), load_robot("jackal")
LIMITS = Limits(1.0, 2.0, 0.5, 4.0, 1.0, 8.0, 1.2, 0.4)
"""m/s, rad/s, m/s^2, rad/s^2, m/s at the wheels, m between them."""


def changed(robot: Robot, section: str, **fields: Any) -> Robot:
    part = msgspec.structs.replace(getattr(robot, section), **fields)
    return msgspec.structs.replace(robot, **{section: part})


def test_the_wheels_turn_slower_under_load() -> None:
    """The motor's speed falls linearly to nothing at its stall torque."""
    assert no_load_wheel_speed(CHEFBOT) == CHEFBOT.motor.no_load_speed * CHEFBOT.wheels.diameter / 2
    share = rolling_torque(CHEFBOT) / CHEFBOT.wheel_stall_torque
    assert 0.0 < share < 0.5
    assert max_wheel_speed(CHEFBOT) == pytest.approx(no_load_wheel_speed(CHEFBOT) * (1.0 - share))
    weak = changed(CHEFBOT, "motor", stall_torque=CHEFBOT.motor.stall_torque * share / 2)
    assert max_wheel_speed(weak) == 0.0, "a motor that cannot roll the robot does not roll it backwards"


def test_both_wheels_share_the_rolling_resistance() -> None:
    """0.015 of the weight on a hard floor, half of it at the circumference of each wheel."""
    assert rolling_torque(CHEFBOT) == pytest.approx(
        0.015 * total_mass(CHEFBOT) * GRAVITY * CHEFBOT.wheel_radius / 2, rel=1e-3
    )


def test_contact_speed_keeps_force_on_a_leg_below_260_newtons() -> None:
    """Energy of the reduced mass in the spring of the leg, ISO/TS 15066 annex A: E = F^2 / 2 k = mu v^2 / 2."""
    mass = total_mass(JACKAL)
    reduced, v = 75.0 * mass / (75.0 + mass), contact_speed(JACKAL)
    assert math.sqrt(reduced * v * v * 60_000.0) == pytest.approx(260.0)


def test_who_sees_one_plane_drives_at_contact_speed() -> None:
    assert JACKAL.sensors.sees_one_plane and max_speed(JACKAL) == contact_speed(JACKAL)
    assert max_speed(CHEFBOT) == CHEFBOT.drive.max_speed < contact_speed(CHEFBOT)
    fast = changed(CHEFBOT, "drive", max_speed=100.0)
    assert max_speed(fast) == max_wheel_speed(fast)
    assert one_plane_warning(CHEFBOT) == ""
    assert f"at most {contact_speed(JACKAL):.2f} m/s" in one_plane_warning(JACKAL)


def test_on_the_spot_one_wheel_goes_forward_and_one_back() -> None:
    """A wheel at 0.3 m/s half of the separation away from the centre: w = v / (b / 2)."""
    assert turn_rate_on_spot(CHEFBOT, 0.3) == pytest.approx(0.3 / (CHEFBOT.wheels.separation / 2))
    assert max_turn(CHEFBOT) == CHEFBOT.drive.max_turn
    quick = changed(CHEFBOT, "drive", max_turn=100.0)
    assert max_turn(quick) == turn_rate_on_spot(quick, max_wheel_speed(quick))


@pytest.mark.parametrize("acceleration", [0.5, 100.0])
@pytest.mark.parametrize("friction", [0.05, 5.0])
def test_acceleration_is_limited_by_request_grip_or_motor(acceleration: float, friction: float) -> None:
    robot = changed(CHEFBOT, "drive", max_acceleration=acceleration, max_turn_acceleration=1000.0)
    robot = changed(robot, "wheels", friction=friction)
    motor = 2.0 * robot.wheel_stall_torque / robot.wheel_radius / total_mass(robot)
    assert max_acceleration(robot) == pytest.approx(min(acceleration, robot.traction * GRAVITY, motor))
    assert max_turn_acceleration(robot) == turn_rate_on_spot(robot, max_acceleration(robot))
    assert max_turn_acceleration(CHEFBOT) == CHEFBOT.drive.max_turn_acceleration


def test_limits_are_those_of_the_robot() -> None:
    figures = (
        *(max_speed, max_turn, max_acceleration, max_turn_acceleration),
        *(max_deceleration, max_turn_deceleration, max_wheel_speed),
    )
    assert Limits.of(CHEFBOT) == (*(figure(CHEFBOT) for figure in figures), CHEFBOT.wheels.separation)


def test_a_stop_uses_the_set_deceleration_or_part_of_the_grip() -> None:
    grip = CHEFBOT.traction * GRAVITY
    assert max_deceleration(CHEFBOT) == pytest.approx(0.7 * grip)
    assert max_deceleration(changed(CHEFBOT, "drive", max_deceleration=1.0)) == 1.0
    assert max_deceleration(changed(CHEFBOT, "drive", max_deceleration=50.0)) == pytest.approx(grip)
    icy = changed(CHEFBOT, "wheels", friction=0.05)
    assert max_deceleration(icy) == max_acceleration(icy)


def test_a_turn_stops_harder_than_it_starts_by_the_same_factor() -> None:
    factor = max_deceleration(CHEFBOT) / max_acceleration(CHEFBOT)
    assert max_turn_deceleration(CHEFBOT) == pytest.approx(factor * max_turn_acceleration(CHEFBOT))


def test_a_deceleration_below_the_acceleration_is_refused() -> None:
    robot = changed(CHEFBOT, "drive", max_deceleration=0.4)
    with pytest.raises(RobotFileError, match=r"r\.yaml: drive\.max_deceleration: is below"):
        check_buildable(robot, "r.yaml")


@pytest.mark.parametrize(
    ("v", "w", "scale"),
    [
        (1.0, 0.0, 1.0),
        (2.0, 0.0, 0.5),
        (-2.0, 0.0, 0.5),
        (0.0, 2.0, 1.0),
        (0.0, -8.0, 0.25),
        (1.0, 1.0, 1.0),
        (0.9, 2.0, 1.2 / 1.3),
        (-0.9, 2.0, 1.2 / 1.3),
        (0.9, -2.0, 1.2 / 1.3),
        (0.0, 0.0, 1.0),
    ],
)
def test_a_twist_is_scaled_into_all_limits(v: float, w: float, scale: float) -> None:
    assert LIMITS.scale(v, w) == pytest.approx(scale)


@given(st.floats(-1e308, 1e308), st.floats(-1e308, 1e308))
def test_the_largest_numbers_are_scaled_as_well(v: float, w: float) -> None:
    scale = LIMITS.scale(v, w)
    assert 0.0 <= scale <= 1.0
    assert abs(v * scale) <= LIMITS.speed * (1 + 1e-9) and abs(w * scale) <= LIMITS.angular_speed * (1 + 1e-9)
    assert abs(v * scale) + abs(w * scale) * 0.2 <= LIMITS.wheel_speed * (1 + 1e-9)
