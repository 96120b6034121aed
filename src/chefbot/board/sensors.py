"""Conversion of the board's lines to ROS messages, in SI units, with covariances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.board.messages import (
    NO_ECHO,
    NO_SENSOR,
    BatteryLine,
    CliffLine,
    EchoLine,
    InertiaLine,
    MotionLine,
)
from chefbot.board.sequence_filter import ReceivedLine
from chefbot.maths.counter_unwrap import CounterUnwrapper, wrap_signed
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.geometry_msgs import Vector3
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import UNKNOWN_COVARIANCE, BatteryState, Imu, Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot

SPEED_OF_SOUND = 343.2
"""Speed of sound in air of 20 degC, m/s."""
RANGE_STD = 0.01
"""Standard deviation of the ultrasonic range, m: the HC-SR04's timer and edge of the echo (its data sheet
promises 3 mm at best)."""
SAMPLE_US = 10_000
"""Period of the board's gyro samples, us."""
MAX_GAP_US = 2_000_000
"""Maximum time between two angles, us; after a longer one the angle may have wrapped: 2^31 * 1e-8 rad at 500
deg/s take 2.46 s."""
INERTIA_AGE_NS = 200_000_000
"""Maximum age of the rates about x and y, ns."""
UNMEASURED_VARIANCE = 1.0
"""Variance of a rate that was not measured, (rad/s)^2."""
DISCHARGING = 2
"""POWER_SUPPLY_STATUS_DISCHARGING of sensor_msgs/BatteryState."""


class _Angle(NamedTuple):
    angle: int
    samples: int
    board_time_us: int


class SensorConverter:
    """Converts lines to `WheelTicks`, `Imu`, `Range` and `BatteryState`.

    The rate about z is the mean since the last `e` line, from the angle that the board integrates: lost lines
    lose no rotation. Rates about x and y and the accelerations are those of the last `i` line; each
    acceleration is published once.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        imu = robot.sensors.imu
        self._gyro_var = imu.gyro_noise**2
        self._acceleration_covariance = imu.accelerometer_noise**2 * np.eye(3).reshape(9)
        self._period_us = 1e6 / imu.rate
        self._restart()

    def _restart(self) -> None:
        self._left, self._right = CounterUnwrapper(), CounterUnwrapper()
        self._angle: _Angle | None = None
        self._inertia: ReceivedLine | None = None
        self._published: ReceivedLine | None = None

    def messages(self, received: ReceivedLine) -> list[Message]:
        """Return the messages of a line; after a restart of the board the tick counts start again."""
        if received.restarted:
            self._restart()
        line = received.line
        if isinstance(line, InertiaLine):
            self._inertia = received
        elif isinstance(line, MotionLine):
            ticks = self._ticks(received.stamp_ns, line)
            return [*self._imu(received, line), ticks]
        elif isinstance(line, EchoLine) and line.echo != NO_SENSOR:
            return self._range(received.stamp_ns, line.echo)
        elif isinstance(line, CliffLine):
            return cliff_messages(received.stamp_ns, line.cliffs, self._robot)
        elif isinstance(line, BatteryLine):
            return [battery_state(received.stamp_ns, line.millivolts / 1000.0, self._robot)]
        return []

    def _ticks(self, stamp_ns: int, line: MotionLine) -> WheelTicks:
        left, right = self._left.update(line.left), self._right.update(line.right)
        return WheelTicks(Header.of(stamp_ns, "base_link"), left, right)

    def _imu(self, received: ReceivedLine, line: MotionLine) -> list[Message]:
        """Return the Imu message, none where gyro samples are missing since the last line."""
        previous, self._angle = self._angle, _Angle(line.angle, line.samples, received.board_time_us)
        if previous is None or not self._complete(previous, self._angle):
            return []
        rate, variance = self._mean_rate(previous, self._angle)
        recent = self._inertia
        # Rates about x and y are unknown without a recent inertia line.
        if recent is None or received.stamp_ns - recent.stamp_ns > INERTIA_AGE_NS:
            unmeasured = (UNMEASURED_VARIANCE, UNMEASURED_VARIANCE, variance)
            return [_imu(received.stamp_ns, (0.0, 0.0, rate), unmeasured)]
        inertia, variances = recent.line, (self._gyro_var, self._gyro_var, variance)
        assert isinstance(inertia, InertiaLine)
        rates = (inertia.gx * 1e-6, inertia.gy * 1e-6, rate)
        if recent is self._published:  # its accelerations were published already
            return [_imu(received.stamp_ns, rates, variances)]
        self._published = recent
        acceleration = Vector3(inertia.ax * 1e-3, inertia.ay * 1e-3, inertia.az * 1e-3)
        return [_imu(received.stamp_ns, rates, variances, acceleration, self._acceleration_covariance)]

    def _mean_rate(self, previous: _Angle, now: _Angle) -> tuple[float, float]:
        """Return the mean rate between two angles and its variance, rad/s and (rad/s)^2."""
        gap_us = now.board_time_us - previous.board_time_us
        # Mean rate about z: difference of the integrated angle over the elapsed time.
        rate = wrap_signed(now.angle - previous.angle) * 1e-8 / (gap_us * 1e-6)
        # White noise: the variance of a mean decreases with the number of samples.
        return rate, self._gyro_var * min(1.0, self._period_us / gap_us)

    @staticmethod
    def _complete(previous: _Angle, now: _Angle) -> bool:
        gap_us = now.board_time_us - previous.board_time_us
        samples = (now.samples - previous.samples) % 65536
        # No sample may be missing in the angle: their number must match the elapsed time.
        return 0 < gap_us <= MAX_GAP_US and samples * SAMPLE_US == gap_us

    def _range(self, stamp_ns: int, echo_us: int) -> list[Message]:
        """Return the range as REP-117 has it: inf without an echo in range, -inf closer than the minimum
        range."""
        sonar = self._robot.sensors.ultrasonic
        if sonar is None:
            return []
        distance = math.inf if echo_us == NO_ECHO else echo_us * 1e-6 * SPEED_OF_SOUND / 2.0
        return [range_message(stamp_ns, distance, self._robot)]


def range_message(stamp_ns: int, distance: float, robot: Robot) -> Range:
    """Convert a distance in m to the Range message of the robot's ultrasonic sensor, which it must have.

    Distances out of range become inf or -inf (REP-117).
    """
    sonar = robot.sensors.ultrasonic
    assert sonar is not None
    limits = (sonar.range_min, sonar.range_max)
    measured = (
        math.inf if distance > sonar.range_max else -math.inf if distance < sonar.range_min else distance
    )
    header = Header.of(stamp_ns, "ultrasonic_link")
    return Range(header, Range.ULTRASOUND, sonar.field_of_view, *limits, measured, RANGE_STD**2)


def cliff_messages(stamp_ns: int, cliffs: int, robot: Robot) -> list[Message]:
    """Convert the bits of the cliff sensors to a Range message each.

    As sensor_msgs/Range has it for a fixed distance: -inf means floor within the range, +inf no floor.
    """
    messages: list[Message] = []
    for i, (frame, sensor) in enumerate(robot.sensors.cliff_sensors.items()):
        measured = math.inf if cliffs >> i & 1 else -math.inf
        limits = (sensor.field_of_view, sensor.range_min, sensor.range_max)
        messages.append(Range(Header.of(stamp_ns, frame), Range.INFRARED, *limits, measured))
    return messages


def battery_state(stamp_ns: int, voltage: float, robot: Robot) -> BatteryState:
    """Estimate the charge from a reading of the voltage, linear from empty to full; the current is not measured."""
    battery = robot.battery
    voltage *= robot.calibration.battery
    share = (voltage - battery.empty_voltage) / (battery.full_voltage - battery.empty_voltage)
    capacity = battery.capacity / 3600.0
    return BatteryState(
        header=Header.of(stamp_ns, "base_link"),
        voltage=voltage,
        capacity=capacity,
        design_capacity=capacity,
        percentage=max(0.0, min(1.0, share)),
        power_supply_status=DISCHARGING,
    )


def _imu(
    stamp_ns: int,
    rates: tuple[float, ...],
    variances: tuple[float, ...],
    acceleration: Vector3 | None = None,
    acceleration_covariance: NDArray[np.float64] = UNKNOWN_COVARIANCE,
) -> Imu:
    """Return an Imu message without orientation, and without accelerations where none are given."""
    covariance = np.zeros(9)
    covariance[::4] = variances  # the diagonal
    return Imu(
        header=Header.of(stamp_ns, "imu_link"),
        orientation_covariance=UNKNOWN_COVARIANCE,
        angular_velocity=Vector3(*rates),
        angular_velocity_covariance=covariance,
        linear_acceleration=acceleration or Vector3(),
        linear_acceleration_covariance=acceleration_covariance,
    )
