"""`ekf.yaml` for robot_localization: wheels and gyro in the plane, noise from the robot.

Names: https://docs.ros.org/en/jazzy/p/robot_localization/ and the package's params/ekf.yaml. Variances of the
measurements come with the messages; of the process they are per second.
"""

from __future__ import annotations

from chefbot.design.export.ros2.annotated_yaml import (
    Explained,
    Tree,
    rounded,
    short,
    with_template,
    yaml_text,
)
from chefbot.design.export.ros2.derived_nav_params import Figures
from chefbot.design.export.ros2.odometry_noise import gyro_deviation, wheels_turn_deviation

STATE = ("x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "vz", "vroll", "vpitch", "vyaw", "ax", "ay", "az")
"""Order of every vector and matrix of robot_localization."""
CONSTANT_STATE_VARIANCE = 1e-6
"""Process variance of states that plane motion keeps constant."""


def ekf(figures: Figures) -> str:
    """Return the YAML file with reasons as comments."""
    return yaml_text(
        ekf_tree(figures),
        f"robot_localization for the robot {figures.robot.name}, written by `chefbot robot export ros2`; "
        "used with odometry:=ekf.\n"
        "It has no state for the gyroscope bias; chefbot's odometry estimates the bias and is the default.",
    )


def ekf_tree(figures: Figures) -> Tree:
    """Return the parameters of the node with their reasons."""
    hz = min(figures.robot.sensors.imu.rate, 50.0)
    derived: Tree = {
        "ekf_filter_node": {
            "ros__parameters": {
                "frequency": Explained(rounded(hz), "the rate of the IMU, 50 at most"),
                "sensor_timeout": Explained(rounded(5.0 / hz), "five missed messages"),
                "two_d_mode": Explained(True, "the robot moves in a plane"),
                "odom0": Explained("wheel_odom", "wheels only, so that the gyroscope is not counted twice"),
                "odom0_config": Explained(fused("vx", "vy", "vyaw"), "vy: no lateral slip"),
                **_gyro(figures),
                "process_noise_covariance": _process(figures),
            }
        }
    }
    return with_template("ekf.yaml", derived)


def fused(*names: str) -> list[bool]:
    """Return which of the 15 elements of the state a sensor measures."""
    return [name in names for name in STATE]


def _gyro(figures: Figures) -> Tree:
    gyro, wheels = gyro_deviation(figures), wheels_turn_deviation(figures)
    reason = (
        f"gyroscope {short(gyro)} rad/s (noise and bias) against the wheels' {short(wheels)} rad/s (slip, diameters,"
        " separation)"
    )
    if gyro > 3.0 * wheels:
        return {"odom0_nodelay": Explained(False, f"no imu0: {reason}: the wheels only are more accurate")}
    return {
        "imu0": Explained("imu/data", reason),
        "imu0_queue_size": 10,
        "imu0_differential": False,
        "imu0_relative": False,
        "imu0_remove_gravitational_acceleration": True,
        "imu0_config": Explained(
            fused("vyaw"), "yaw rate; the accelerometer measures vibration of the plates"
        ),
    }


def _process(figures: Figures) -> Explained:
    """Diagonal, row by row."""
    variances = dict.fromkeys(STATE, CONSTANT_STATE_VARIANCE) | _plane_variances(figures)
    rows = [[rounded(variances[row]) if row == column else 0.0 for column in STATE] for row in STATE]
    reason = ", ".join(
        f"{name} {short(value)}" for name, value in variances.items() if value != CONSTANT_STATE_VARIANCE
    )
    return Explained(
        [value for row in rows for value in row],
        f"variances per second on the diagonal: {reason}. x, y: slip^2 v; yaw: 2 slip^2 v / separation^2; vx: a v"
        " (acceleration to full speed is one deviation); vyaw: the same for turns; ax: a^2",
    )


def _plane_variances(figures: Figures) -> dict[str, float]:
    """Return the process variances of the states that plane motion changes."""
    v, w = figures.speed.number, figures.turn.number
    slip, separation = figures.odometry_errors.slip, figures.robot.wheels.separation
    return {
        "x": slip**2 * v,
        "y": slip**2 * v,
        "yaw": 2 * slip**2 * v / separation**2,
        "vx": figures.acceleration.number * v,
        "vyaw": figures.turn_acceleration.number * w,
        "ax": figures.acceleration.number**2,
    }
