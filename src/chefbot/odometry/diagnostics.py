"""Diagnostic messages about the health of the odometry sensors."""

from __future__ import annotations

import math

from chefbot.odometry.ekf import Ekf
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.robot.spec import GRAVITY

SIDES = ("left", "right")
NO_FAULT = "Wheels and gyro agree."
_FAULT_TEXTS = {
    Condition.STUCK: "is stuck: its readings are bit-identical while the wheels turn",
    Condition.SATURATED: "is saturated",
    Condition.REVERSED: "turns against the wheels: a wheel slips, the robot was pushed, or its sign is wrong",
    Condition.LATE: "is late",
}
UPSIDE_DOWN = (
    "The gyro turns against the wheels and gravity points upwards: the IMU is mounted upside down; "
    "continuing with the wheels alone."
)
WITHOUT_IMU = (
    "The robot has tipped over or is held aslant: continuing with the wheels alone until it stands upright."
)
MOTION_FORCE = 0.05
"""Deviation of the specific force from gravity, as a share of it, that shows that the robot was lifted or pushed."""
_CONSEQUENCES = {
    Source.GYRO: "continuing with the wheels alone",
    Source.ACCELEROMETER: "assuming a level floor",
    Source.ATTITUDE: "continuing without it",
}


def diagnostic_message(ekf: Ekf, now_ns: int) -> str | None:
    """Return a message with all sensor faults at a stamp, or None if there is none."""
    if ekf.belief.stamp_ns is None:
        return None  # no wheel reading yet
    if ekf.tilted:
        return WITHOUT_IMU
    messages = [_source_message(ekf, source, now_ns) for source in Source]
    messages.append(_contradiction_message(ekf))
    return " ".join(sentence for sentence in messages if sentence) or None


def _source_message(ekf: Ekf, source: Source, now_ns: int) -> str | None:
    condition = ekf.condition(source, now_ns)
    if condition is Condition.FRESH or (condition is Condition.ABSENT and source is not Source.GYRO):
        return None
    if source is Source.WHEELS:
        return _wheel_message(ekf, condition, now_ns)
    if condition in (Condition.LOST, Condition.ABSENT):
        age = ekf.time_since_used(source, now_ns)
        silent = f"No {source.value} for {age:.1f} s" if age < 1e6 else f"No {source.value} so far"
        return f"{silent}: {_CONSEQUENCES[source]}."
    if condition is Condition.REVERSED and _specific_force(ekf)[2] < 0.0:
        return UPSIDE_DOWN
    left_out = "" if condition is Condition.LATE else f"; {_CONSEQUENCES[source]}"
    return f"The {source.value} {_FAULT_TEXTS[condition]}{left_out}."


def _wheel_message(ekf: Ekf, condition: Condition, now_ns: int) -> str:
    if condition is Condition.LOST:
        return (
            f"No wheels for {ekf.time_since_used(Source.WHEELS, now_ns):.1f} s: "
            "assuming standstill; the covariance of the pose grows."
        )
    return f"The wheels' counts {_FAULT_TEXTS.get(condition, condition.value)}."


def _contradiction_message(ekf: Ekf) -> str | None:
    belief = ekf.belief
    if belief.dead_encoder_side is not None:
        silent, other = SIDES[belief.dead_encoder_side], SIDES[1 - belief.dead_encoder_side]
        return (
            f"The {silent} wheel counts nothing while the {other} one rolls and the gyro does not turn: "
            f"its encoder is dead, or the {other} wheel spins."
        )
    if not ekf.slipping:
        return None
    if not belief.counters.standing:
        return "Wheels and gyro disagree: the wheels slip, or the gyro's offset has changed."
    if _is_moved(ekf):
        return "The gyro measures rotation but the wheels stand still: robot carried, or both encoders dead."
    return (
        "The gyro measures rotation, but the wheels stand still and the accelerometer shows no motion: "
        "the gyro's offset has changed, or the robot was turned."
    )


def _specific_force(ekf: Ekf) -> tuple[float, float, float]:
    """Return the last reading of the accelerometer in the robot's axes, m/s^2; NaN before the first."""
    x, y, z = ekf.belief.monitors[Source.ACCELEROMETER].value
    return x, y, z


def _is_moved(ekf: Ekf) -> bool:
    """Return whether the accelerometer shows that the robot is lifted, tilted or pushed; True without a reading."""
    x, y, z = _specific_force(ekf)
    deviation = math.hypot(x, y, z - GRAVITY)
    return not deviation < MOTION_FORCE * GRAVITY  # true for NaN
