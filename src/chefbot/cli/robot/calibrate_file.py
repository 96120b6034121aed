"""The results of a calibration as keys of a robot file."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.calibration.calibrate import CalibrationResult
from chefbot.calibration.wheels import WheelParams
from chefbot.design.sizing.robot_file_editor import COMMENT_COLUMN
from chefbot.errors import UserError, name_hint
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.robot.load import LIKE, built_in_robots, find_robot
from chefbot.robot.spec import Robot

MIN_DEVIATIONS = {"wheel": 5e-4, "separation": 1e-3, "gyro": 1e-3}
"""Minimum standard deviations in the robot file, for wear of the tyres and other loads and floors."""
KEYS = {"laser": "lidar_yaw", "camera_link": "camera_yaw", "camera_depth_frame": "camera_yaw"}
NAMES = {"lidar_yaw": "lidar", "camera_yaw": "camera"}
MOUNT_THRESHOLD = 0.006
"""Offset of a sensor from its mount above which it is reported, m."""


class CalibrationChange(NamedTuple):
    """One key of the section `calibration`: value before, value found, standard deviation, in SI units."""

    key: str
    before: float
    value: float
    deviation: float
    unit: str = ""

    def text_of(self, value: float, *, signed: bool = False) -> str:
        """Return a value as text: angles in degrees, factors unchanged, small ratios in per cent."""
        if self.unit:
            degrees = math.degrees(value)
            return f"{degrees:+.3f} {self.unit}" if signed else f"{degrees:.3f} {self.unit}"
        share = f"{100 * value:+.3f} %" if signed else f"{100 * value:.3f} %"
        return f"{value:.5f}" if abs(value) > 0.5 else share

    @property
    def text(self) -> str:
        """The value found, as YAML."""
        return f"{math.degrees(self.value):.4f} {self.unit}" if self.unit else f"{self.value:.6f}"


class Findings(NamedTuple):
    """All calibrated keys, and the offset of the sensor from its mount, m."""

    values: tuple[CalibrationChange, ...]
    sensor: str
    mount_off: tuple[float, float]
    mount_threshold: float
    reason: str


def findings_of(result: CalibrationResult, robot: Robot, mount: SE2, frame: str) -> Findings:
    """Return the results compared with the robot file that was assumed.

    frame: frame_id of the scans. Raises UserError if the robot file has no yaw of a sensor of that name.
    """
    if frame not in KEYS:
        raise UserError(
            f"the scans are in the frame {frame!r}, of which the robot file has no yaw to calibrate"
            f"{name_hint(frame, KEYS)}; set the frame in the sensor's driver"
        )
    old, solution, gyro = robot.calibration, result.solution, result.gyro
    left, right, separation = solution.wheels.factors(WheelParams.nominal(robot))
    sd = solution.deviations.tolist()
    key = KEYS[frame]
    yaw = getattr(old, key) + wrap(solution.sensor.yaw - mount.yaw)
    values = (
        CalibrationChange("left_wheel", old.left_wheel, left, sd[0]),
        CalibrationChange("right_wheel", old.right_wheel, right, sd[1]),
        CalibrationChange("separation", old.separation, separation, sd[2]),
        CalibrationChange("gyro_scale", old.gyro_scale, gyro.scale, gyro.deviations[0]),
        CalibrationChange("gyro_offset", old.gyro_offset, gyro.offset, gyro.deviations[1], "deg/s"),
        CalibrationChange(key, getattr(old, key), yaw, sd[5], "deg"),
    )
    drives, slipped = len(solution.slipped), int(solution.slipped.sum())
    reason = (
        f"{drives} drives between {len(solution.poses)} stations ({slipped} slipped); systematic error of squares "
        f"{1000 * result.before.worst:.0f} mm before, {1000 * result.after.worst:.1f} mm after"
    )
    off = (solution.sensor.x - mount.x, solution.sensor.y - mount.y)
    return Findings(values, NAMES[key], off, MOUNT_THRESHOLD, reason)


def robot_text(found: Findings, robot: str) -> str:
    """Return a robot file, for any folder, that extends `robot` by its calibration."""
    like = robot if robot in built_in_robots() else str(find_robot(robot).resolve())
    lines = [
        "# Measured by `chefbot robot calibrate`: " + found.reason + ".",
        f"{LIKE}: {like}",
        "",
        "calibration:",
    ]
    lines += [_line(one.key, one.text, _comment(one)) for one in found.values]
    return "\n".join([*lines, *_deviation_lines(found)]) + "\n"


def _deviation_lines(found: Findings) -> list[str]:
    """Return the entries of the standard deviations, which are not below their minimums."""
    lines = []
    deviation = {one.key: one.deviation for one in found.values}
    worst = max(deviation["left_wheel"], deviation["right_wheel"])
    for key, value in (
        ("wheel", worst),
        ("separation", deviation["separation"]),
        ("gyro", deviation["gyro_scale"]),
    ):
        minimum = MIN_DEVIATIONS[key]
        comment = f"measured to {100 * value:.3f} %; minimum {100 * minimum:.2f} %, for wear, load and floor"
        lines.append(_line(f"{key}_deviation", f"{max(value, minimum):.6f}", comment))
    return lines


def _comment(one: CalibrationChange) -> str:
    if one.key == "gyro_offset":
        return f"at rest and in motion; +- {one.text_of(one.deviation)}"
    return f"was {one.text_of(one.before)}; from the scanned walls, +- {one.text_of(one.deviation)}"


def _line(key: str, text: str, comment: str) -> str:
    entry = f"  {key}: {text}"
    return f"{entry:<{COMMENT_COLUMN}}  # {comment}"
