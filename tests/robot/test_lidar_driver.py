"""The keys `driver` and `port` of a robot file's lidar."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.errors import ChefbotError
from chefbot.lidar.models import LIDARS
from chefbot.robot.load import load_robot, parse_robot
from chefbot.robot.sensors import LIDAR_DRIVERS


def robot_with(keys: str) -> bytes:
    return f"like: chefbot_lidar\nsensors: {{lidar: {{{keys}}}}}\n".encode()


def test_the_names_are_those_of_the_drivers() -> None:
    assert set(LIDAR_DRIVERS) == set(LIDARS)


def test_a_built_in_robot_names_its_lidar() -> None:
    lidar = load_robot("chefbot_lidar").sensors.lidar
    assert lidar is not None and (lidar.driver, lidar.port) == ("ld19", "auto")


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ("driver: ld91", "sensors.lidar.driver: unknown 'ld91' (did you mean 'ld19'?)"),
        ('driver: "", port: /dev/ttyUSB0', "sensors.lidar.driver: is missing beside sensors.lidar.port"),
        ("port: ''", "sensors.lidar.port"),
    ],
)
def test_a_wrong_key_is_reported_in_one_sentence(keys: str, sentence: str) -> None:
    with pytest.raises(ChefbotError) as error:
        parse_robot(robot_with(keys), Path("mine.yaml"))
    assert sentence in str(error.value) and "\n" not in str(error.value)
