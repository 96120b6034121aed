"""The numbers of a generated robot, and the ranges that a seed draws them from."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.random import Generator

from chefbot.design.errors import DesignError
from chefbot.maths.number_range import NumberRange, check_name

NUMBERS: Mapping[str, NumberRange] = {
    "radius": NumberRange(0.16, 0.25, "m", "radius of the plates"),
    "bay": NumberRange(0.15, 0.20, "m", "distance between two plates"),
    "wheel_diameter": NumberRange(0.085, 0.15, "m", "diameter of the wheels"),
    "wheel_width": NumberRange(0.012, 0.025, "m", "width of the tyres"),
    "payload": NumberRange(0.5, 4.0, "kg", "payload"),
    "speed": NumberRange(0.25, 0.8, "m/s", "maximum speed"),
    "turn": NumberRange(0.8, 2.0, "rad/s", "maximum turn rate"),
    "acceleration": NumberRange(0.3, 0.8, "m/s^2", "maximum acceleration"),
    "slope": NumberRange(1.0, 5.0, "deg", "steepest ramp"),
    "run_time": NumberRange(1.0, 2.5, "h", "run time of one battery charge"),
    "gyro_noise": NumberRange(0.02, 0.2, "deg/s", "standard deviation of a reading of the gyro"),
    "gyro_bias": NumberRange(0.1, 0.6, "deg/s", "standard deviation of the gyro's bias at power-up"),
    "obstacle_sensors": NumberRange(0, 2, "", "0: a lidar, 1: a depth camera, 2: both", whole=True),
    "ultrasonic": NumberRange(0, 1, "", "ultrasonic rangers at the front", whole=True),
    "sensor_bay": NumberRange(1, 2, "", "plate above which the lidar stands, else the camera", whole=True),
    "lidar_full_turn": NumberRange(
        0, 1, "", "1: the lidar scans a full turn, 0: lidar_field_of_view", whole=True
    ),
    "lidar_field_of_view": NumberRange(90.0, 360.0, "deg", "field of view of the lidar"),
    "lidar_step": NumberRange(0.25, 1.0, "deg", "angle between two beams of the lidar"),
    "lidar_height": NumberRange(
        0.0, 1.0, "", "height of the lidar, as a share of the free height of its bay"
    ),
    "lidar_range": NumberRange(5.0, 25.0, "m", "maximum range of the lidar"),
    "lidar_rate": NumberRange(5, 25, "Hz", "scans per second", whole=True),
    "lidar_noise": NumberRange(0.003, 0.03, "m", "standard deviation of a range of the lidar"),
    "camera_field_of_view": NumberRange(55.0, 90.0, "deg", "horizontal field of view of the depth camera"),
    "camera_height": NumberRange(
        0.0, 1.0, "", "height of the depth camera, as a share of the free height of its bay"
    ),
    "camera_range": NumberRange(4.0, 10.0, "m", "maximum range of the depth camera"),
    "camera_range_min": NumberRange(0.2, 0.5, "m", "minimum range of the depth camera"),
    "camera_rate": NumberRange(5, 15, "Hz", "depth images per second", whole=True),
    "camera_noise": NumberRange(0.001, 0.003, "1/m", "noise of a depth over its square"),
}
LIDAR, CAMERA, BOTH = range(3)
"""Values of `obstacle_sensors`."""


def draw_numbers(given: Mapping[str, float], rng: Generator) -> dict[str, float]:
    """Draw every number from its range, and replace those that are given.

    Given numbers do not change what the others are drawn as. Raises DesignError for an unknown name and for a number
    outside its range.
    """
    for name, value in given.items():
        check_name("a generated robot", name, NUMBERS, DesignError)
        NUMBERS[name].check(f"{name} of a generated robot", value, DesignError)
    return {**{name: one.draw(rng) for name, one in NUMBERS.items()}, **given}
