"""The firmware's constants: whole numbers that follow from the robot, in the order that the firmware reads."""

from __future__ import annotations

import math
import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.board.firmware_constants import as_int32, firmware_constants
from chefbot.robot.errors import RobotFileError
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_acceleration, max_deceleration, max_speed, max_wheel_speed
from chefbot.robot.spec import Robot

CORE = Path(__file__).parents[2] / "firmware" / "core"


@pytest.fixture
def robot() -> Robot:
    return load_robot("chefbot")


def values(robot: Robot) -> dict[str, int]:
    return {c.name: c.value for c in firmware_constants(robot)}


def test_field_order_is_that_of_the_firmware() -> None:
    text = (CORE / "robot.h").read_text()
    struct = text[text.index("struct RobotConstants") : text.index("};")]
    fields = re.findall(r"int32_t (\w+);", struct)
    assert fields == [c.name for c in firmware_constants(load_robot("chefbot"))]


def test_constants_follow_from_the_robot(robot: Robot) -> None:
    number = values(robot)
    turn = robot.motor.ticks_per_turn
    per_metre = turn / (2 * math.pi * robot.wheel_radius)
    assert number["ticks_per_turn_milli"] == round(1000 * turn)
    assert number["max_wheel"] / per_metre == pytest.approx(max_wheel_speed(robot), rel=1e-3)
    assert number["max_wheel"] <= max_wheel_speed(robot) * per_metre
    assert number["max_forward"] / per_metre == pytest.approx(max_speed(robot), rel=1e-3)
    assert number["acceleration"] / per_metre == pytest.approx(max_acceleration(robot), rel=1e-3)
    assert number["deceleration"] / per_metre == pytest.approx(max_deceleration(robot), rel=1e-3)
    assert number["no_load"] == pytest.approx(robot.motor.no_load_speed * turn / (2 * math.pi), abs=1)
    assert number["battery_stop"] == round(1000 * robot.battery.empty_voltage) < number["battery_low"]


def test_the_hash_depends_on_every_constant(robot: Robot) -> None:
    heavier = msgspec.structs.replace(
        robot,
        battery=msgspec.structs.replace(robot.battery, empty_voltage=robot.battery.empty_voltage + 0.01),
    )
    assert values(robot)["hash"] == values(robot)["hash"]
    assert values(robot)["hash"] != values(heavier)["hash"]


def test_an_encoder_too_fine_for_the_board_is_refused(robot: Robot) -> None:
    fast = msgspec.structs.replace(robot.motor, no_load_speed=40.0)
    with pytest.raises(RobotFileError, match="ticks/s"):
        firmware_constants(msgspec.structs.replace(robot, motor=fast))


def test_an_acceleration_too_small_for_the_board_is_refused(robot: Robot) -> None:
    lazy = msgspec.structs.replace(robot.drive, max_acceleration=1e-3)
    with pytest.raises(RobotFileError, match="max_acceleration"):
        firmware_constants(msgspec.structs.replace(robot, drive=lazy))


def test_a_deceleration_too_large_for_the_board_is_refused(robot: Robot) -> None:
    hard = msgspec.structs.replace(robot.drive, max_deceleration=50.0)
    sticky = msgspec.structs.replace(robot.wheels, friction=20.0)
    with pytest.raises(RobotFileError, match="max_deceleration"):
        firmware_constants(msgspec.structs.replace(robot, drive=hard, wheels=sticky))


@given(st.integers(0, 2**32 - 1))
def test_conversion_to_int32_keeps_the_bits(value: int) -> None:
    signed = as_int32(value)
    assert -(2**31) <= signed < 2**31 and signed % 2**32 == value
