"""Sensors of generated robots: their housings lie between the plates, and their numbers are those that were drawn."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.design.generation.parameters import BOTH, CAMERA, LIDAR, NUMBERS
from chefbot.design.generation.sensor_mounts import (
    ABOVE_BOXES,
    HOUSING_CLEARANCE,
    IMU_HEIGHT,
    RANGER_HEIGHT,
    sensors_of,
)
from chefbot.design.sizing.dependent_dimensions import with_radius
from chefbot.robot.geometry import layout
from chefbot.robot.load import load_robot
from chefbot.robot.sensors import DepthCamera, Lidar, Ultrasonic
from chefbot.robot.spec import Robot

TEMPLATE = load_robot("chefbot")
ROUNDING = 1e-3
"""Mounts are written to a millimetre."""


def number(name: str) -> st.SearchStrategy[float]:
    one = NUMBERS[name]
    whole = st.integers(int(one.low), int(one.high)).map(float)
    return whole if one.whole else st.floats(one.low, one.high)


DRAWN = st.fixed_dictionaries({name: number(name) for name in NUMBERS})


def plated(n: dict[str, float]) -> Robot:
    """Return a robot with the plates of the numbers."""
    robot = with_radius(TEMPLATE, n["radius"])
    return msgspec.structs.replace(robot, tubes=msgspec.structs.replace(robot.tubes, length=n["bay"]))


def box(sensor: Lidar | DepthCamera | Ultrasonic) -> tuple[list[float], list[float]]:
    """Return the lowest and the highest corner of a housing in base_link."""
    housing, mount = sensor.housing, sensor.mount
    assert housing is not None
    centre = [getattr(mount, axis) + getattr(housing.centre, axis) for axis in "xyz"]
    half = [getattr(housing.size, axis) / 2.0 for axis in "xyz"]
    return [c - h for c, h in zip(centre, half, strict=True)], [
        c + h for c, h in zip(centre, half, strict=True)
    ]


def below(sensor: Lidar | DepthCamera | Ultrasonic, plate: int) -> float:
    """Return the height that stays free for the equipment of a plate, counted from 0, below a sensor."""
    if isinstance(sensor, Ultrasonic):
        return 0.0
    ahead = isinstance(sensor, DepthCamera) or sensor.field_of_view <= math.pi
    return RANGER_HEIGHT if ahead else ABOVE_BOXES[plate + 1]


@settings(max_examples=30)
@given(DRAWN)
def test_housings_lie_between_two_plates_and_within_their_edge(n: dict[str, float]) -> None:
    robot, sensors = plated(n), sensors_of(plated(n), n)
    undersides = layout.plate_undersides(robot)
    for sensor in (sensors.lidar, sensors.depth_camera, sensors.ultrasonic):
        if sensor is None:
            continue
        low, high = box(sensor)
        plate = max(k for k, z in enumerate(undersides) if low[2] > z)
        assert (
            low[2]
            >= undersides[plate]
            + robot.plates.thickness
            + HOUSING_CLEARANCE
            + below(sensor, plate)
            - ROUNDING
        )
        assert high[2] <= undersides[plate + 1] - HOUSING_CLEARANCE + ROUNDING
        farthest = max(math.hypot(x, y) for x in (low[0], high[0]) for y in (low[1], high[1]))
        assert farthest <= n["radius"] - HOUSING_CLEARANCE + ROUNDING


@settings(max_examples=30)
@given(DRAWN)
def test_the_sensors_are_those_that_were_drawn(n: dict[str, float]) -> None:
    robot, sensors = plated(n), sensors_of(plated(n), n)
    assert (sensors.lidar is not None) == (n["obstacle_sensors"] in (LIDAR, BOTH))
    assert (sensors.depth_camera is not None) == (n["obstacle_sensors"] in (CAMERA, BOTH))
    assert (sensors.ultrasonic is not None) == bool(n["ultrasonic"])
    if sensors.lidar is not None and sensors.depth_camera is not None:
        # each has a bay of its own
        middle = layout.plate_undersides(robot)[1]
        assert (sensors.lidar.mount.z > middle) != (sensors.depth_camera.mount.z > middle)
        assert (sensors.lidar.mount.z > middle) == (n["sensor_bay"] == 2)
    assert sensors.imu.mount.z == pytest.approx(layout.plate_top(robot, 1) + IMU_HEIGHT, abs=ROUNDING)
    assert math.degrees(sensors.imu.gyro_noise) == pytest.approx(n["gyro_noise"], abs=1e-4)
    assert math.degrees(sensors.imu.gyro_bias) == pytest.approx(n["gyro_bias"], abs=1e-4)


@settings(max_examples=30)
@given(DRAWN)
def test_the_beams_of_a_lidar_have_the_step_between_them(n: dict[str, float]) -> None:
    lidar = sensors_of(plated(n), {**n, "obstacle_sensors": LIDAR}).lidar
    assert lidar is not None
    full = bool(n["lidar_full_turn"])
    degrees = 360.0 if full else n["lidar_field_of_view"]
    assert math.degrees(lidar.field_of_view) == pytest.approx(degrees, abs=1e-4)
    assert lidar.full_turn == (degrees == 360.0)
    # a whole number of steps fits into the field of view
    assert math.degrees(lidar.angle_increment) == pytest.approx(
        n["lidar_step"], rel=0.51 * n["lidar_step"] / 90
    )
    assert (lidar.range_max, lidar.rate, lidar.noise) == (n["lidar_range"], n["lidar_rate"], n["lidar_noise"])


@pytest.mark.parametrize("step", [0.25, 1.0])
@pytest.mark.parametrize("full", [0, 1])
def test_a_field_of_view_of_360_degrees_has_no_beam_twice(step: float, full: int) -> None:
    n = {name: one.low for name, one in NUMBERS.items()}
    lidar = sensors_of(
        plated(n), {**n, "lidar_full_turn": full, "lidar_field_of_view": 360.0, "lidar_step": step}
    ).lidar
    assert lidar is not None and lidar.full_turn and lidar.beams == round(360.0 / step)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_height_is_a_share_of_the_free_height(share: float) -> None:
    n = {name: one.low for name, one in NUMBERS.items()} | {"lidar_full_turn": 1.0, "bay": 0.2}
    heights = []
    for one in (0.0, share, 1.0):
        lidar = sensors_of(plated(n), {**n, "lidar_height": one}).lidar
        assert lidar is not None
        heights.append(lidar.mount.z)
    low, at, high = heights
    assert high > low and at == pytest.approx(low + share * (high - low), abs=ROUNDING)


def test_a_lidar_of_a_full_turn_stands_in_the_middle() -> None:
    n = {name: one.low for name, one in NUMBERS.items()}
    full, part = (sensors_of(plated(n), {**n, "lidar_full_turn": k}).lidar for k in (1.0, 0.0))
    assert full is not None and part is not None
    assert full.mount.x == 0.0 and box(part)[1][0] > 0.8 * n["radius"]
    assert full.mount.z > part.mount.z, "above the battery, which a lidar that looks ahead does not see"


def test_a_template_without_a_ranger_gives_none() -> None:
    sensors = msgspec.structs.replace(TEMPLATE.sensors, ultrasonic=None)
    robot = msgspec.structs.replace(TEMPLATE, sensors=sensors)
    n = {name: one.low for name, one in NUMBERS.items()} | {"ultrasonic": 1.0}
    assert sensors_of(robot, n).ultrasonic is None
