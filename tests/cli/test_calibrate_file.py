"""The results of a calibration as keys of a robot file, and as a picture."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.calibration.calibrate import CalibrationResult
from chefbot.calibration.gyro import GyroSolution
from chefbot.calibration.solve import Solution
from chefbot.calibration.umbmark import ReturnErrors, Umbmark
from chefbot.calibration.wheels import WheelParams
from chefbot.cli.robot.calibrate_file import KEYS, MIN_DEVIATIONS, CalibrationChange, findings_of, robot_text
from chefbot.cli.robot.calibrate_picture import picture
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot, parse_robot

ROBOT = load_robot("chefbot_lidar")
MOUNT = SE2(0.1, 0.0, 0.2)
SQUARES = np.array([[0.1, 0.02], [0.12, 0.03]])


def result(
    *,
    left: float = 1.01,
    right: float = 0.99,
    separation: float = 1.02,
    yaw: float = 0.0,
    deviation: float = 1e-4,
) -> CalibrationResult:
    """Factors to the drawn wheels, and the yaw of the sensor beyond its mount, rad."""
    drawn = WheelParams.nominal(ROBOT)
    wheels = WheelParams(left * drawn.left, right * drawn.right, separation * drawn.separation)
    covariance = np.diag([deviation**2, (2.0 * deviation) ** 2, (3.0 * deviation) ** 2, 1.0, 1.0, 0.001**2])
    sensor = SE2(MOUNT.x + 0.004, MOUNT.y - 0.002, MOUNT.yaw + yaw)
    solution = Solution(wheels, sensor, [MOUNT] * 5, covariance, (1e-3, 1e-3), np.array([True, False, True]))
    gyro = GyroSolution(0.98, 0.01, (2e-3, 1e-4))
    before, after = ReturnErrors(SQUARES, -SQUARES), ReturnErrors(0.01 * SQUARES, -0.01 * SQUARES)
    ratios = Umbmark(1.0, 1.0)
    return CalibrationResult(solution, solution, gyro, ratios, before, after, before, after, 7)


def test_findings_are_factors_to_the_drawn_wheels() -> None:
    found = findings_of(result(yaw=0.03), ROBOT, MOUNT, "laser")
    values = {one.key: one.value for one in found.values}
    assert values == pytest.approx(
        {"left_wheel": 1.01, "right_wheel": 0.99, "separation": 1.02, "gyro_scale": 0.98, "gyro_offset": 0.01,
         "lidar_yaw": ROBOT.calibration.lidar_yaw + 0.03}
    )  # fmt: skip
    deviations = {one.key: one.deviation for one in found.values}
    assert deviations["left_wheel"] == pytest.approx(1e-4)
    assert deviations["right_wheel"] == pytest.approx(2e-4)
    assert deviations["separation"] == pytest.approx(3e-4)
    assert deviations["lidar_yaw"] == pytest.approx(0.001)
    assert found.mount_off == pytest.approx((0.004, -0.002))
    assert found.sensor == "lidar"
    assert found.reason.startswith("3 drives between 5 stations (2 slipped); ")
    assert found.reason.endswith(f"{1000 * math.hypot(0.11, 0.025):.0f} mm before, 1.1 mm after")


def test_a_yaw_beyond_a_full_turn_is_wrapped() -> None:
    found = findings_of(result(yaw=2.0 * math.pi - 0.01), ROBOT, MOUNT, "laser")
    assert found.values[-1].value == pytest.approx(ROBOT.calibration.lidar_yaw - 0.01)


@pytest.mark.parametrize(("frame", "key"), KEYS.items())
def test_each_frame_calibrates_the_yaw_of_its_sensor(frame: str, key: str) -> None:
    assert findings_of(result(), ROBOT, MOUNT, frame).values[-1].key == key


def test_scans_in_a_frame_of_no_sensor_are_refused() -> None:
    with pytest.raises(UserError, match=r"in the frame 'lase', .* \(did you mean 'laser'\?\); set the frame"):
        findings_of(result(), ROBOT, MOUNT, "lase")


@settings(max_examples=10)  # each reads two robot files
@given(st.floats(0.95, 1.05), st.floats(0.95, 1.05), st.floats(-0.1, 0.1), st.floats(1e-6, 2e-3))
def test_the_file_gives_the_robot_that_was_found(
    left: float, right: float, yaw: float, deviation: float
) -> None:
    found = findings_of(result(left=left, right=right, yaw=yaw, deviation=deviation), ROBOT, MOUNT, "laser")
    robot = parse_robot(robot_text(found, "chefbot_lidar").encode(), Path("robot.yaml"))
    assert robot.calibration.left_wheel == pytest.approx(left, abs=1e-6)
    assert robot.calibration.right_wheel == pytest.approx(right, abs=1e-6)
    assert robot.calibration.lidar_yaw == pytest.approx(ROBOT.calibration.lidar_yaw + yaw, abs=1e-6)
    assert robot.calibration.gyro_offset == pytest.approx(0.01, abs=1e-6)
    assert robot.calibration.wheel_deviation == pytest.approx(
        max(2.0 * deviation, MIN_DEVIATIONS["wheel"]), abs=1e-6
    ), "that of the worse wheel, and at least the minimum"
    assert robot.calibration.separation_deviation == pytest.approx(
        max(3.0 * deviation, MIN_DEVIATIONS["separation"]), abs=1e-6
    )
    assert robot.wheels == ROBOT.wheels


def test_a_file_of_the_owner_is_extended_by_its_full_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.yaml").write_text("like: chefbot_lidar\n")
    monkeypatch.chdir(tmp_path)
    found = findings_of(result(), ROBOT, MOUNT, "laser")
    assert yaml.safe_load(robot_text(found, "mine.yaml"))["like"] == str(tmp_path / "mine.yaml")
    assert yaml.safe_load(robot_text(found, "chefbot_lidar"))["like"] == "chefbot_lidar"


@pytest.mark.parametrize(
    ("value", "unit", "plain", "signed"),
    [
        (1.0125, "", "1.01250", "1.01250"),
        (0.0125, "", "1.250 %", "+1.250 %"),
        (-0.5, "", "-50.000 %", "-50.000 %"),
        (math.pi / 180.0, "deg", "1.000 deg", "+1.000 deg"),
        (-math.pi, "deg/s", "-180.000 deg/s", "-180.000 deg/s"),
    ],
)
def test_values_are_shown_in_their_units(value: float, unit: str, plain: str, signed: str) -> None:
    change = CalibrationChange("key", 1.0, value, 0.0, unit)
    assert (change.text_of(value), change.text_of(value, signed=True)) == (plain, signed)


def test_the_picture_is_a_png_also_of_a_perfect_robot() -> None:
    found = findings_of(result(), ROBOT, MOUNT, "laser")
    exact = ReturnErrors(np.zeros((1, 2)), np.zeros((1, 2)))
    for one in (result(), result()._replace(before=exact, after=exact)):
        assert picture(one, found, ROBOT)[:8] == b"\x89PNG\r\n\x1a\n"
