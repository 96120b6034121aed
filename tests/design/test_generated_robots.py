"""Generated robots: valid, the same for the same seed, read from their file as they were, and able to drive."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from chefbot.board.firmware_constants import firmware_constants
from chefbot.design.checks.geometry_checks import check
from chefbot.design.checks.sensor_occlusion import hidden_sectors
from chefbot.design.errors import DesignError
from chefbot.design.generation.generate import MAX_TICK, GeneratedRobot, generate_robot
from chefbot.design.generation.parameters import BOTH, CAMERA, LIDAR, NUMBERS, draw_numbers
from chefbot.design.sizing.requirements import judge
from chefbot.design.sizing.stability import loaded
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.load import load_robot, parse_robot
from chefbot.robot.spec import Robot

TEMPLATE, CATALOGUE = load_robot("chefbot"), load_catalogue()


def generated(seed: int, **given: float) -> GeneratedRobot:
    return generate_robot(seed, given, TEMPLATE, CATALOGUE)


def assert_valid(robot: Robot) -> None:
    assert [found.sentence for found in check(robot, CATALOGUE) if found.severity == "error"] == []
    failed = [one.name for one in judge(robot, loaded(robot)) if not one.passed]
    assert set(failed) <= {"input level without a level shifter"}
    assert robot.metres_per_tick <= MAX_TICK
    assert all(abs(constant.value) < 2**32 for constant in firmware_constants(robot))
    lidar, camera = robot.sensors.lidar, robot.sensors.depth_camera
    assert lidar is not None or camera is not None
    if lidar is not None:
        assert math.pi / 2 - 1e-6 <= lidar.field_of_view <= 2 * math.pi
        assert hidden_sectors(robot, lidar).farthest + 3 * lidar.noise <= lidar.range_min


@pytest.mark.rotated("checks of any robot")
@pytest.mark.parametrize("seed", range(1, 21, 2))
@pytest.mark.slow
def test_a_generated_robot_is_valid(seed: int) -> None:
    assert_valid(generated(seed).robot)


@pytest.mark.long
def test_two_hundred_generated_robots_are_valid() -> None:
    for seed in range(1, 401, 2):
        one = generated(seed)
        assert_valid(one.robot)
        assert one.text("") == generated(seed).text("")


@pytest.mark.slow
def test_the_same_seed_gives_the_same_text() -> None:
    assert generated(9).text("") == generated(9).text("")
    assert generated(9).text("") != generated(11).text("")


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_the_file_of_a_robot_gives_that_robot(seed: int) -> None:
    one = generated(seed)
    assert parse_robot(one.text("a notice").encode(), Path("robot.yaml")) == one.robot


@pytest.mark.slow
def test_given_numbers_are_kept_and_change_no_other() -> None:
    free, fixed = generated(7).robot, generated(7, radius=0.24, obstacle_sensors=LIDAR, lidar_rate=11).robot
    assert fixed.body.radius == 0.24
    assert fixed.sensors.lidar is not None and fixed.sensors.lidar.rate == 11
    assert fixed.sensors.depth_camera is None
    assert fixed.wheels.diameter == free.wheels.diameter


@pytest.mark.parametrize("kind", [LIDAR, CAMERA, BOTH])
def test_the_robot_has_the_requested_sensors(kind: int) -> None:
    sensors = generated(5, obstacle_sensors=kind, ultrasonic=0).robot.sensors
    assert (sensors.lidar is not None) == (kind in (LIDAR, BOTH))
    assert (sensors.depth_camera is not None) == (kind in (CAMERA, BOTH))
    assert sensors.ultrasonic is None


def test_every_number_is_drawn_from_its_range() -> None:
    for seed in range(100):
        for name, value in draw_numbers({}, np.random.default_rng(seed)).items():
            assert NUMBERS[name].low <= value <= NUMBERS[name].high


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"radus": 0.2}, "did you mean 'radius'"),
        ({"radius": 2.0}, "from 0.16 to 0.25 m"),
        ({"obstacle_sensors": 0.5}, "a whole number from 0 to 2"),
    ],
)
def test_a_bad_number_is_reported_in_one_sentence(given: dict[str, float], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        generate_robot(1, given, TEMPLATE, CATALOGUE)
