"""Deviations of a simulated robot from its drawing: profiles `perfect`, `real` and `assembled`."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.robot.as_built import AS_DRAWN, AsBuilt
from chefbot.robot.sensors import ImuSpec

RealismProfile = Literal["perfect", "real", "assembled"]
"""`real`: assembled with care and measured by hand. `assembled`: as first put together, never calibrated."""
MIN_KINEMATIC_ERROR, MAX_KINEMATIC_ERROR = 0.002, 0.005
"""Relative errors of the wheels' mean diameter, of the wheel separation, and of the wheels' diameter ratio:
the three errors that UMBmark identifies (Borenstein & Feng, Measurement and correction of systematic odometry
errors in mobile robots, 1996)."""
MAX_GYRO_SCALE_ERROR = 0.003
"""Maximum relative error of a calibrated gyro's sensitivity."""
MIN_DIAMETER_ERROR, MIN_SEPARATION_ERROR, MIN_GYRO_ERROR = 0.01, 0.02, 0.01
"""Minimum relative errors of an uncalibrated robot: mean wheel diameter and diameter ratio, wheel separation,
gyro scale."""
MIN_YAW_ERROR = math.radians(1.0)
"""Minimum yaw misalignment of its camera and lidar."""
MAX_TO_MIN_ERROR = 1.25
"""Ratio of the maximum to the minimum of these errors."""
MIN_FRICTION_FACTOR = 0.75  # share of the tyre's friction coefficient left on the worst floor
FRICTION_RIPPLE = 0.1  # relative amplitude of the spatial variation of friction
FRICTION_WAVES = 3
LOWEST_FRICTION, MAX_FRICTION_RIPPLE = 0.1, 0.9
"""Bounds for floors that are worse than real ones."""


def check_profile(profile: str) -> None:
    """Raise UserError if a profile's name is unknown."""
    if profile not in get_args(RealismProfile):
        raise UserError(f"--profile {profile} must be real, perfect or assembled")


def draw_as_built(profile: RealismProfile, rng: Generator, odometry_error: float = 1.0) -> AsBuilt:
    """Draw the deviations of one robot for a profile; `odometry_error` scales those that odometry suffers from."""
    if profile == "perfect":
        return AS_DRAWN
    if profile == "assembled":
        return _draw_uncalibrated(rng, odometry_error)
    magnitude = odometry_error * rng.uniform(MIN_KINEMATIC_ERROR, MAX_KINEMATIC_ERROR, 3)
    # Relative errors of wheel diameter, diameter ratio and separation, each with random magnitude and sign.
    scale, difference, separation = (magnitude * rng.choice([-1.0, 1.0], 3)).tolist()
    friction = _draw_friction_factor(rng, odometry_error)
    return AsBuilt(1.0 + scale - difference / 2, 1.0 + scale + difference / 2, 1.0 + separation, friction)


def _draw_friction_factor(rng: Generator, odometry_error: float) -> float:
    return max(LOWEST_FRICTION, float(rng.uniform(1.0 - odometry_error * (1.0 - MIN_FRICTION_FACTOR), 1.0)))


def _draw_uncalibrated(rng: Generator, odometry_error: float) -> AsBuilt:
    wheels, yaws = [MIN_DIAMETER_ERROR] * 2 + [MIN_SEPARATION_ERROR], [MIN_YAW_ERROR] * 2
    odometry = [odometry_error * error for error in (*wheels, MIN_GYRO_ERROR)]
    minimum = np.array([*odometry, *yaws])
    errors = (minimum * rng.uniform(1.0, MAX_TO_MIN_ERROR, 6) * rng.choice([-1.0, 1.0], 6)).tolist()
    scale, difference, separation, gyro, lidar, camera = errors
    left, right = 1.0 + scale - difference / 2, 1.0 + scale + difference / 2
    friction = _draw_friction_factor(rng, odometry_error)
    return AsBuilt(left, right, 1.0 + separation, friction, 1.0 + gyro, lidar, camera)


def draw_gyro_scale(as_built: AsBuilt, rng: Generator, odometry_error: float = 1.0) -> float:
    """Return the ratio of measured to true turn rate, with the drift of the gyro's sensitivity."""
    drift = odometry_error * float(rng.uniform(-MAX_GYRO_SCALE_ERROR, MAX_GYRO_SCALE_ERROR))
    return as_built.gyro_scale * (1.0 + drift)


class ImuErrors(NamedTuple):
    """Errors of an IMU in a reading (6,) of angular velocity, rad/s, and specific force, m/s^2.

    Gyro: scale factor, turn-on bias, white noise; accelerometer: white noise.
    """

    scale: NDArray[np.float64]
    offset: NDArray[np.float64]
    deviation: NDArray[np.float64]

    @staticmethod
    def of(
        imu: ImuSpec, gyro_scale: float, gyro_offset: NDArray[np.float64], odometry_error: float
    ) -> ImuErrors:
        """Return the errors of a gyro with this scale factor and this bias (3,), rad/s; its noise is scaled."""
        scale, deviation = (gyro_scale, 1.0), (odometry_error * imu.gyro_noise, imu.accelerometer_noise)
        offset = np.concatenate((gyro_offset, np.zeros(3)))
        return ImuErrors(np.repeat(scale, 3), offset, np.repeat(deviation, 3))

    def apply(self, reading: NDArray[np.float64], rng: Generator) -> None:
        """Add the errors to a reading in place."""
        noise = rng.standard_normal(6)
        noise *= self.deviation
        noise += self.offset
        reading *= self.scale
        reading += noise


class FloorFriction(NamedTuple):
    """Spatially varying floor friction: a sum of a few plane waves of 1 to 4 m wavelength."""

    waves: NDArray[np.float64]
    """(n, 3): wave vector x, y in rad/m, and phase in rad."""
    ripple: float = FRICTION_RIPPLE
    """Relative amplitude of the variation."""

    def factor(self, x: float, y: float) -> float:
        """Return the factor on the tyre's friction coefficient at a point of the floor."""
        height = sum(math.sin(kx * x + ky * y + phase) for kx, ky, phase in self.waves.tolist())
        return 1.0 + self.ripple * height / max(len(self.waves), 1)


def draw_floor_friction(
    profile: RealismProfile, rng: Generator, odometry_error: float = 1.0
) -> FloorFriction:
    """Draw the friction of one floor; the perfect one is uniform."""
    if profile == "perfect":
        return FloorFriction(np.zeros((0, 3)))
    direction, phase = rng.uniform(-math.pi, math.pi, (2, FRICTION_WAVES))
    wavenumber = 2.0 * math.pi / rng.uniform(1.0, 4.0, FRICTION_WAVES)
    return FloorFriction(
        np.column_stack([wavenumber * np.cos(direction), wavenumber * np.sin(direction), phase]),
        min(MAX_FRICTION_RIPPLE, odometry_error * FRICTION_RIPPLE),
    )
