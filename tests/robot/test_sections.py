"""Sections of a robot file: drivetrain, sensors, materials and the bounds of quantities."""

from __future__ import annotations

import math
from pathlib import Path
from typing import get_args

import msgspec
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from chefbot.robot import quantities
from chefbot.robot.drivetrain import ROTOR_INERTIA_FACTOR, Calibration
from chefbot.robot.errors import RobotFileError
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.materials import MATERIALS
from chefbot.robot.sensors import DepthCamera, Sensors
from chefbot.scan.usable_range import usable_range

ROBOTS = [load_robot(name) for name in sorted(built_in_robots())]
CHEFBOT = load_robot("chefbot")


def camera() -> DepthCamera:
    found = CHEFBOT.sensors.depth_camera
    assert found is not None
    return found


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_reflected_inertia_scales_with_the_squared_gear_ratio(robot) -> None:
    motor = robot.motor
    doubled = msgspec.structs.replace(motor, gear_ratio=2.0 * motor.gear_ratio)
    assert doubled.rotor_inertia == pytest.approx(4.0 * motor.rotor_inertia)
    assert doubled.ticks_per_turn == pytest.approx(2.0 * motor.ticks_per_turn)
    assert motor.rotor_inertia == pytest.approx(
        ROTOR_INERTIA_FACTOR * motor.mass * motor.diameter**2 * motor.gear_ratio**2
    )


def test_an_uncalibrated_robot_has_neutral_factors() -> None:
    neutral = Calibration()
    assert (neutral.left_wheel, neutral.right_wheel, neutral.separation, neutral.gyro_scale) == (1.0,) * 4
    turned = Calibration(lidar_yaw=0.02, camera_yaw=-0.01)
    assert [turned.yaw_of(frame) for frame in ("laser", "camera_link", "imu_link")] == [0.02, -0.01, 0.0]


def test_focal_length_maps_the_view_edge_to_the_image_edge() -> None:
    edge = camera().focal_length_px * math.tan(camera().field_of_view / 2)
    assert edge == pytest.approx(camera().width / 2)


@given(st.floats(1e-4, 1.0))
def test_depth_noise_at_the_range_is_the_given_deviation(deviation: float) -> None:
    limit = camera().range_with_noise(deviation)
    assert limit <= camera().range_max
    if limit < camera().range_max:
        assert camera().noise * limit**2 == pytest.approx(deviation)
    exact = msgspec.structs.replace(camera(), noise=0.0)
    assert exact.range_with_noise(deviation) == exact.range_max


def test_the_mapping_sensor_gives_the_usable_range() -> None:
    lidar_robot = load_robot("chefbot_lidar")
    lidar = lidar_robot.sensors.lidar
    assert lidar is not None and usable_range(lidar_robot, 0.05) == lidar.range_max
    assert usable_range(CHEFBOT, 0.05) == camera().range_with_noise(0.05)
    blind = msgspec.structs.replace(CHEFBOT, sensors=Sensors(imu=CHEFBOT.sensors.imu))
    assert usable_range(blind, 0.05) == 0.0


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_frames_are_those_of_the_mounted_sensors(robot) -> None:
    sensors = robot.sensors
    assert sensors.by_frame["imu_link"] is sensors.imu
    assert ("laser" in sensors.by_frame) == (sensors.lidar is not None) != sensors.forward_sensing_only


def test_densities_and_colours_are_physical() -> None:
    for material in MATERIALS.values():
        assert 500.0 < material.density < 9000.0
        assert all(0.0 <= channel <= 1.0 for channel in material.colour)


@pytest.mark.parametrize("name", [name for name in vars(quantities) if name[0].isupper()])
def test_every_quantity_has_bounds_in_order(name: str) -> None:
    kind = getattr(quantities, name)
    meta = next((one for one in get_args(kind)[1:] if isinstance(one, msgspec.Meta)), None)
    if meta is None or get_args(kind)[0] is str:
        return
    low = meta.gt if meta.gt is not None else meta.ge
    assert low is not None and (meta.le is None or low < meta.le)
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(low - 1, kind)


@pytest.mark.parametrize(
    ("lens", "key", "reason"),
    [
        (
            {"fx": 2000, "fy": 2000, "cx": 320, "cy": 240},
            "lens.fx",
            "shows 18 degrees, but field_of_view is 65",
        ),
        ({"fx": 510, "fy": 50, "cx": 320, "cy": 240}, "lens.fy", "pixels are nearly square"),
        ({"fx": 510, "fy": 510, "cx": 700, "cy": 240}, "lens.cx", "the calibration is that of another size"),
    ],
)
def test_a_lens_of_another_camera_is_refused(
    tmp_path: Path, lens: dict[str, float], key: str, reason: str
) -> None:
    file = tmp_path / "robot.yaml"
    camera = {
        "mount": {"x": "12 cm", "z": "16 cm"},
        "housing": {"size": {"x": "2 cm", "y": "7 cm", "z": "3 cm"}, "mass": "80 g"},
        **{"rate": "5 Hz", "width": 640, "height": 480, "field_of_view": "65 deg", "lens": lens},
    }
    file.write_text(yaml.safe_dump({"like": "chefbot", "name": "seer", "sensors": {"color_camera": camera}}))
    with pytest.raises(RobotFileError, match=rf"sensors\.color_camera\.{key}: .*{reason}"):
        load_robot(str(file))
