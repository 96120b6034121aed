"""Odometry errors as the noise parameters of AMCL and robot_localization."""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import Explained, rounded, short
from chefbot.design.export.ros2.derived_nav_params import Figures

MARGIN = 3.0
"""Standard deviations: particles must cover the true pose after large errors, not only after mean ones."""
SPREAD = 0.25
"""Minimum spread of the particles along their motion per update, cells; it prevents their collapse."""


def alphas(figures: Figures, travel: float, turned: float) -> dict[str, Explained]:
    """Return AMCL's alpha1 .. alpha4 for an update every `travel` metres or `turned` radians.

    AMCL's variances are alpha1 turn^2 + alpha2 travel^2 of a turn, alpha3 travel^2 + alpha4 turn^2 of a
    length (Thrun, Burgard & Fox 2005, table 5.6 in variances, as nav2_amcl's DifferentialMotionModel has
    them). Here the travel s of each wheel has the independent error slip sqrt(s) + diameter_error s, and the
    separation its relative error.
    """
    slip, diameter, share = figures.odometry_errors
    separation = figures.robot.wheels.separation
    arc = turned * separation / 2  # travel of a wheel in a turn on the spot
    wheel = slip**2 / travel + diameter**2  # variance of a wheel's travel, over travel^2
    on_spot = (slip**2 * arc + (diameter * arc) ** 2) / turned**2
    spread = SPREAD * figures.resolution.number
    values = (
        MARGIN**2 * (share**2 + 2 * on_spot / separation**2),
        MARGIN**2 * 2 * wheel / separation**2,
        max(MARGIN**2 * wheel / 2, (spread / travel) ** 2),
        max(MARGIN**2 * on_spot / 2, (spread / turned) ** 2),
    )
    texts = (
        "a turn's error from a turn: separation_error^2 + 2 e^2 / separation^2, e the error of a wheel",
        "a turn's error from travel: 2 e^2 / separation^2, e a wheel's error over one update",
        "a length's error from travel: e^2 / 2, the mean of two wheels, a quarter cell per update at least",
        "a length's error from a turn: e^2 / 2, a quarter cell per update at least",
    )
    odometry_errors = (
        f"slip {short(slip)} m after 1 m, diameter {short(100 * diameter)} %, {MARGIN:g} standard deviations"
    )
    return {
        f"alpha{i}": Explained(rounded(value), f"{text}; {odometry_errors}")
        for i, (value, text) in enumerate(zip(values, texts, strict=True), start=1)
    }


def gyro_deviation(figures: Figures) -> float:
    """Return the gyroscope deviation, rad/s: noise and the bias, which robot_localization does not estimate."""
    imu = figures.robot.sensors.imu
    return math.hypot(imu.gyro_noise, imu.gyro_bias)


def wheels_turn_deviation(figures: Figures) -> float:
    """Return the standard deviation of the wheels' turn rate over one second, rad/s.

    Causes: slip, unequal wheels and the error of the separation, at maximum speed and turn rate.
    """
    slip, diameter, share = figures.odometry_errors
    v, separation = figures.speed.number, figures.robot.wheels.separation
    unequal = math.sqrt(2.0) * math.hypot(slip * math.sqrt(v), diameter * v) / separation
    return math.hypot(unequal, share * figures.turn.number)
