"""What makes a simulated robot as imperfect as a built one: profiles `perfect`, `real` and `assembled`."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from chefbot.design.export.mjcf import AS_DRAWN, AsBuilt

Profile = Literal["perfect", "real", "assembled"]
"""`real`: put together with care, and its numbers measured by hand. `assembled`: as it comes from the bench."""
SMALLEST_ERROR, LARGEST_ERROR = 0.002, 0.005
"""Share by which the wheels' mean diameter and the track differ from the drawing, and the wheels from each
other: the three errors that UMBmark sets out to find (Borenstein & Feng, Measurement and correction of
systematic odometry errors in mobile robots, 1996)."""
GYRO_GAIN_ERROR = 0.003
"""Share by which a calibrated gyro's sensitivity is off at most."""
TYRE_FAULT, SEPARATION_FAULT, GYRO_FAULT = 0.01, 0.02, 0.01
"""Shares by which an assembled robot is off at least: the wheels' mean diameter and the wheels from each other,
the track, the gyro."""
YAW_FAULT = math.radians(1.0)
"""By which its camera and lidar look askew at least."""
WORST = 1.25
"""Times those at most."""
LEAST_GRIP = 0.75  # of the tyre's friction, on the worst floor
GRIP_RIPPLE = 0.1  # of the friction, from place to place
GRIP_WAVES = 3


def draw_as_built(profile: Profile, rng: Generator) -> AsBuilt:
    """One robot of the series."""
    if profile == "perfect":
        return AS_DRAWN
    if profile == "assembled":
        return _assembled(rng)
    size = rng.uniform(SMALLEST_ERROR, LARGEST_ERROR, 3)
    scale, difference, track = (size * rng.choice([-1.0, 1.0], 3)).tolist()
    grip = float(rng.uniform(LEAST_GRIP, 1.0))
    return AsBuilt(1.0 + scale - difference / 2, 1.0 + scale + difference / 2, 1.0 + track, grip)


def _assembled(rng: Generator) -> AsBuilt:
    least = np.array([TYRE_FAULT, TYRE_FAULT, SEPARATION_FAULT, GYRO_FAULT, YAW_FAULT, YAW_FAULT])
    faults = (least * rng.uniform(1.0, WORST, 6) * rng.choice([-1.0, 1.0], 6)).tolist()
    scale, difference, track, gyro, lidar, camera = faults
    return AsBuilt(
        1.0 + scale - difference / 2,
        1.0 + scale + difference / 2,
        1.0 + track,
        float(rng.uniform(LEAST_GRIP, 1.0)),
        1.0 + gyro,
        lidar,
        camera,
    )


def draw_gyro_scale(as_built: AsBuilt, rng: Generator) -> float:
    """What the gyro tells of a turn of 1, drift of its sensitivity included."""
    return as_built.gyro_scale * (1.0 + float(rng.uniform(-GYRO_GAIN_ERROR, GYRO_GAIN_ERROR)))


class FloorGrip(NamedTuple):
    """Friction that differs from place to place: a few plane waves of 1 to 4 m length."""

    waves: NDArray[np.float64]
    """(n, 3): wave vector x, y in rad/m, and phase."""

    def factor(self, x: float, y: float) -> float:
        """Of the tyre's friction at a point of the floor."""
        ripple = sum(math.sin(kx * x + ky * y + phase) for kx, ky, phase in self.waves.tolist())
        return 1.0 + GRIP_RIPPLE * ripple / max(len(self.waves), 1)


def draw_grip(profile: Profile, rng: Generator) -> FloorGrip:
    """One floor; the perfect one is the same everywhere."""
    if profile == "perfect":
        return FloorGrip(np.zeros((0, 3)))
    bearing, phase = rng.uniform(-math.pi, math.pi, (2, GRIP_WAVES))
    number = 2.0 * math.pi / rng.uniform(1.0, 4.0, GRIP_WAVES)
    return FloorGrip(np.column_stack([number * np.cos(bearing), number * np.sin(bearing), phase]))
