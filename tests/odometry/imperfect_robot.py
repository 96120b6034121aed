"""Simulates encoders and gyro of a robot whose dimensions differ from its robot file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.motion_model import arc
from chefbot.robot.spec import Robot

RATE = 50.0


@dataclass(frozen=True)
class Faults:
    """Standard deviations, as in OdometryParams; gyro noise and bias are those of the Robot."""

    slip: float = 0.003
    diameter: float = 0.003
    separation: float = 0.005
    gyro_gain: float = 0.0


@dataclass(frozen=True)
class Reading:
    """Encoder counts, yaw rate in rad/s and true pose after a step."""

    left: int
    right: int
    gyro_z: float
    truth: SE2


def hotel_drive(stand: float = 3.0, metres: float = 40.0) -> list[tuple[float, float]]:
    """Return (v, w) for every step: standstill, then squares of 5 m to the left and to the right on a wavy line."""
    dt, v = 1.0 / RATE, 0.3
    commands = [(0.0, 0.0)] * int(stand * RATE)
    driven, side = 0.0, 0
    while driven < metres:
        length = min(5.0, metres - driven)
        swing = 0.15 * np.sin(np.linspace(0.0, 2.0 * np.pi, int(length / v / dt)))
        commands += [(v, float(w)) for w in swing]
        direction = 1.0 if side % 8 < 4 else -1.0
        commands += [(0.0, direction * 0.8)] * int(np.pi / 2 / 0.8 / dt)
        driven, side = driven + length, side + 1
    return commands


def drive(
    robot: Robot, commands: list[tuple[float, float]], faults: Faults, rng: np.random.Generator
) -> Iterator[Reading]:
    """Yield a reading at the start and one after each command, which lasts 1 / RATE seconds."""
    dt, base = 1.0 / RATE, robot.wheels.separation * (1.0 + faults.separation * rng.normal())
    diameters = 1.0 + faults.diameter * rng.normal(size=2)
    imu = robot.sensors.imu
    bias, gain = imu.gyro_bias * rng.normal(), 1.0 + faults.gyro_gain * rng.normal()
    v, w = np.array([(0.0, 0.0), *commands]).T
    wheel_travel = dt * np.column_stack([v - 0.5 * w * base, v + 0.5 * w * base])
    # a slipping wheel turns as commanded but travels another distance on the floor
    ground_travel = wheel_travel + faults.slip * np.sqrt(np.abs(wheel_travel)) * rng.normal(
        size=wheel_travel.shape
    )
    counts = np.floor(np.cumsum(wheel_travel / diameters, axis=0) / robot.metres_per_tick).astype(np.int64)
    turns = (ground_travel[:, 1] - ground_travel[:, 0]) / base
    gyro = gain * turns / dt + bias + imu.gyro_noise * rng.normal(size=len(turns))
    truth = IDENTITY
    for step, turn, ticks, rate in zip(ground_travel.mean(axis=1), turns, counts, gyro, strict=True):
        truth = truth @ SE2(*arc(float(step), float(turn)), float(turn))
        yield Reading(int(ticks[0]), int(ticks[1]), float(rate), truth)
