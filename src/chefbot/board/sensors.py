"""The board's lines as ROS messages, in SI units, with covariances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.board.counter_unwrap import Unwrapped, signed
from chefbot.board.messages import NO_ECHO, NO_SENSOR, Battery, Echo, Inertia, Motion
from chefbot.board.sequence_filter import Heard
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.geometry_msgs import Vector3
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import UNKNOWN_COVARIANCE, BatteryState, Imu, Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot

SPEED_OF_SOUND = 343.2
"""m/s in air of 20 degC."""
ECHO_DEVIATION = 0.01
"""Metres; the HC-SR04's timer and edge of the echo (its data sheet promises 3 mm at best)."""
SAMPLE_US = 10_000
"""Between two gyro samples of the board."""
LONGEST_GAP_US = 2_000_000
"""Over a longer one the angle may have wrapped: 2^31 * 1e-8 rad at 500 deg/s take 2.46 s."""
INERTIA_AGE_NS = 200_000_000
"""Older rates about x and y say nothing of now."""
UNTOLD_RATE = 1.0
"""(rad/s)^2 of an axis that was not heard of."""
DISCHARGING = 2
"""sensor_msgs/BatteryState."""


class _Turn(NamedTuple):
    angle: int
    samples: int
    board_us: int


class Sensors:
    """Turns lines into `WheelTicks`, `Imu`, `Range` and `BatteryState`.

    The rate about z is the mean since the last `e` line, from the angle that the board adds up: lost lines
    lose nothing. Rates about x and y and the accelerations are of the last `i` line, each told once.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        imu = robot.sensors.imu
        self._gyro = imu.gyro_noise**2
        self._force = imu.accelerometer_noise**2 * np.eye(3).reshape(9)
        self._period_us = 1e6 / imu.rate
        self._restart()

    def _restart(self) -> None:
        self._left, self._right = Unwrapped(), Unwrapped()
        self._turn: _Turn | None = None
        self._inertia: Heard | None = None
        self._told: Heard | None = None

    def messages(self, heard: Heard) -> list[Message]:
        """What a line says; after a restart of the board the ticks begin anew."""
        if heard.restarted:
            self._restart()
        line = heard.line
        if isinstance(line, Inertia):
            self._inertia = heard
        elif isinstance(line, Motion):
            ticks = WheelTicks(
                Header.of(heard.stamp_ns, "base_link"),
                self._left.update(line.left),
                self._right.update(line.right),
            )
            return [*self._imu(heard, line), ticks]
        elif isinstance(line, Echo) and line.echo != NO_SENSOR:
            return self._range(heard.stamp_ns, line.echo)
        elif isinstance(line, Battery):
            return [battery_state(heard.stamp_ns, line.millivolts / 1000.0, self._robot)]
        return []

    def _imu(self, heard: Heard, line: Motion) -> list[Message]:
        """None where the gyro missed a sample since the last line."""
        before, self._turn = self._turn, _Turn(line.angle, line.samples, heard.board_us)
        if before is None or not self._whole(before, self._turn):
            return []
        gap_us = self._turn.board_us - before.board_us
        rate = signed(line.angle - before.angle) * 1e-8 / (gap_us * 1e-6)
        variance = self._gyro * min(1.0, self._period_us / gap_us)
        recent = self._inertia
        if recent is None or heard.stamp_ns - recent.stamp_ns > INERTIA_AGE_NS:
            return [_imu(heard.stamp_ns, (0.0, 0.0, rate), (UNTOLD_RATE, UNTOLD_RATE, variance))]
        assert isinstance(recent.line, Inertia)
        rates = (recent.line.gx * 1e-6, recent.line.gy * 1e-6, rate)
        return [self._with_force(heard.stamp_ns, rates, (self._gyro, self._gyro, variance), recent)]

    def _with_force(
        self, stamp_ns: int, rates: tuple[float, ...], variances: tuple[float, ...], recent: Heard
    ) -> Imu:
        """The accelerations unless they were told before."""
        if recent is self._told:
            return _imu(stamp_ns, rates, variances)
        self._told = recent
        line = recent.line
        assert isinstance(line, Inertia)
        force = Vector3(line.ax * 1e-3, line.ay * 1e-3, line.az * 1e-3)
        return _imu(stamp_ns, rates, variances, force, self._force)

    @staticmethod
    def _whole(before: _Turn, now: _Turn) -> bool:
        gap_us = now.board_us - before.board_us
        samples = (now.samples - before.samples) % 65536
        return 0 < gap_us <= LONGEST_GAP_US and samples * SAMPLE_US == gap_us

    def _range(self, stamp_ns: int, echo_us: int) -> list[Message]:
        """REP-117: inf heard nothing in reach, -inf is closer than the ranger can tell."""
        sonar = self._robot.sensors.ultrasonic
        if sonar is None:
            return []
        distance = math.inf if echo_us == NO_ECHO else echo_us * 1e-6 * SPEED_OF_SOUND / 2.0
        return [range_message(stamp_ns, distance, self._robot)]


def range_message(stamp_ns: int, distance: float, robot: Robot) -> Range:
    """A distance in m of the robot's ranger, which it must have; out of reach as REP-117 has it."""
    sonar = robot.sensors.ultrasonic
    assert sonar is not None
    reach = (sonar.range_min, sonar.range_max)
    told = math.inf if distance > sonar.range_max else -math.inf if distance < sonar.range_min else distance
    header = Header.of(stamp_ns, "ultrasonic_link")
    return Range(header, Range.ULTRASOUND, sonar.field_of_view, *reach, told, ECHO_DEVIATION**2)


def battery_state(stamp_ns: int, voltage: float, robot: Robot) -> BatteryState:
    """What a voltage tells: the share of charge in a straight line from empty to full, no current."""
    battery = robot.battery
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
    force: Vector3 | None = None,
    force_covariance: NDArray[np.float64] = UNKNOWN_COVARIANCE,
) -> Imu:
    """Without attitude; without accelerations where none are given."""
    return Imu(
        header=Header.of(stamp_ns, "imu_link"),
        orientation_covariance=UNKNOWN_COVARIANCE,
        angular_velocity=Vector3(*rates),
        angular_velocity_covariance=np.diag(variances).reshape(9),
        linear_acceleration=force or Vector3(),
        linear_acceleration_covariance=force_covariance,
    )
