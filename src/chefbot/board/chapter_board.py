"""Driver for the book chapter's original board: it takes duty cycles, has no CRC and no command watchdog.

The wheel speed control therefore runs here, at a low maximum speed: if this program crashes, the motors keep
the last duty cycle.
"""

from __future__ import annotations

import math

import numpy as np

from chefbot.board.chapter_messages import (
    DUTY_FULL,
    EDGES_PER_TICK,
    ChapterAttitude,
    ChapterBattery,
    ChapterEcho,
    ChapterLine,
    ChapterReader,
    ChapterTicks,
    ChapterTime,
    duty_line,
)
from chefbot.board.command_gate import NEVER_NS, STANDSTILL, CommandGate
from chefbot.board.sensors import range_message
from chefbot.board.wheel_pid import WheelPid
from chefbot.maths.clock_sync import ClockSync
from chefbot.maths.counter_unwrap import wrap_signed
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, WARN, DiagnosticStatus, KeyValue
from chefbot.msgs.geometry_msgs import Quaternion
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import UNKNOWN_COVARIANCE, Imu
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot

MAX_SPEED = 0.15
"""Maximum speed of either wheel at the ground, m/s: only the hardware switch stops this board."""
SILENCE_NS = 300_000_000
"""Without encoder ticks for this long, ns, the wheel motion is unknown and the wheels are stopped."""
ATTITUDE_STD = 0.01
"""Standard deviation of the attitude, rad; a component of the quaternion is rounded by up to 0.005, the angle
by twice that."""
MAX_SPEED_FACTOR = 1.5
"""Ticks beyond this multiple of the motor's no-load speed are a damaged line, not motion."""
NOTICE = (
    "this is the chapter's own firmware: no checksum, no watchdog, no volts; its wheels are limited to "
    f"{MAX_SPEED} m/s and would go on turning if this computer failed: flash ours, with `chefbot board flash`"
)


class ChapterLink:
    """The `MotorBoardLink` of the chapter's board.

    Ticks are published in ticks of the robot file: four per tick of the board.
    """

    refused: str | None = None
    notice: str | None = NOTICE
    fault = ""
    """It reports none."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._reader = ChapterReader()
        self._pids = (WheelPid(robot), WheelPid(robot))
        self._max_tick_rate = MAX_SPEED_FACTOR * robot.motor.no_load_tick_rate
        self._gate = CommandGate(MAX_SPEED / robot.wheel_radius)
        self._battery: int | None = None
        self.connection_lost()

    def connection_lost(self) -> None:
        """Reset commands and counters after the serial connection was lost; an emergency stop stays latched."""
        self._reader.clear()
        self._gate.reset()
        self._ticks_ns = NEVER_NS
        self._duty = (0, 0)
        self._reset_board_state()

    def _reset_board_state(self) -> None:
        self._time: ClockSync | None = None
        self._board_us = self._stamp_ns = 0
        self._ticks: tuple[int, int] | None = None
        self._ticks_us = 0
        self._ticks_rejected = False
        for pid in self._pids:
            pid.reset()

    @property
    def is_open(self) -> bool:
        """Whether encoder ticks have been received since the serial connection was opened."""
        return self._ticks is not None

    # -- from the board

    def receive_data(self, data: bytes, now_ns: int) -> list[Message]:
        """Return the messages of well-formed lines; lines before the first `t` line have no time stamp and
        are dropped."""
        messages: list[Message] = []
        for line in self._reader.read(data):
            if isinstance(line, ChapterTime):
                self._update_clock(line.t, now_ns)
            elif self._time is not None:
                messages += self._process_line(line, now_ns)
        return messages

    def _update_clock(self, t_us: int, now_ns: int) -> None:
        if self._time is not None:
            full_us = self._time.unwrap(t_us, now_ns)
            # A board time that jumps back or is far off the clock model: the board has restarted.
            if full_us < self._board_us or abs(self._time.delay_ns(full_us, now_ns)) > SILENCE_NS * 10:
                self._reset_board_state()
        if self._time is None:
            self._time, self._board_us = ClockSync(t_us, now_ns), t_us
        self._board_us = self._time.unwrap(t_us, now_ns)
        self._stamp_ns = self._time.stamp(self._board_us, now_ns)

    def _process_line(self, line: ChapterLine, now_ns: int) -> list[Message]:
        if isinstance(line, ChapterTicks):
            return self._process_ticks(EDGES_PER_TICK * line.left, EDGES_PER_TICK * line.right, now_ns)
        if isinstance(line, ChapterEcho) and self._robot.sensors.ultrasonic is not None:
            distance = line.centimetres / 100.0 if line.centimetres else math.inf
            return [range_message(self._stamp_ns, distance, self._robot)]
        if isinstance(line, ChapterAttitude):
            return self._attitude(line)
        if isinstance(line, ChapterBattery):
            self._battery = line.raw
        return []

    def _process_ticks(self, left: int, right: int, now_ns: int) -> list[Message]:
        previous, dt = self._ticks, (self._board_us - self._ticks_us) / 1e6
        if previous is not None and dt <= 0.0:
            return []
        if previous is not None:
            # Tick differences across the wraparound of the scaled 32-bit counters.
            bits = 32 + EDGES_PER_TICK.bit_length() - 1
            deltas = (wrap_signed(left - previous[0], bits), wrap_signed(right - previous[1], bits))
            # Plausibility gate: reject jumps that the motor cannot make in dt.
            if max(map(abs, deltas)) > self._max_tick_rate * dt + EDGES_PER_TICK:
                return self._reject_ticks()
            left, right = previous[0] + deltas[0], previous[1] + deltas[1]
            self._control(deltas, dt, now_ns)
        self._ticks, self._ticks_rejected = (left, right), False
        self._ticks_us, self._ticks_ns = self._board_us, now_ns
        return [WheelTicks(Header.of(self._stamp_ns, "base_link"), left, right)]

    def _reject_ticks(self) -> list[Message]:
        """Drop an implausible jump; two in a row mean that the board has restarted."""
        if self._ticks_rejected:
            self._reset_board_state()
        else:
            self._ticks_rejected = True
        return []

    def _control(self, deltas: tuple[int, int], dt: float, now_ns: int) -> None:
        target = self._gate.speeds(now_ns) if self._may_drive(now_ns) else STANDSTILL
        # One PI controller with feed-forward per wheel gives the duty cycle.
        duties = (
            pid.update(speed, ticks, dt) for pid, speed, ticks in zip(self._pids, target, deltas, strict=True)
        )
        left, right = (round(DUTY_FULL * duty) for duty in duties)
        self._duty = (left, right)

    def _attitude(self, line: ChapterAttitude) -> list[Message]:
        values = np.array([line.x, line.y, line.z, line.w])
        norm = float(np.linalg.norm(values))
        # A quaternion far from unit norm is a damaged line.
        if abs(norm - 1.0) > 0.05:
            return []
        return [
            Imu(
                header=Header.of(self._stamp_ns, "imu_link"),
                orientation=Quaternion(*(values / norm).tolist()),
                orientation_covariance=(ATTITUDE_STD**2 * np.eye(3)).reshape(9),
                angular_velocity_covariance=UNKNOWN_COVARIANCE,
                linear_acceleration_covariance=UNKNOWN_COVARIANCE,
            )
        ]

    # -- to the board

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """Set the angular velocities of the wheels, rad/s, both scaled down by one factor to MAX_SPEED.

        The duty cycle follows with the next ticks, so there is nothing to send at once.
        """
        self._gate.command(left, right, now_ns)
        return b""

    def stop(self, now_ns: int) -> bytes:
        """Latch the emergency stop and return the line with duty 0, which brakes."""
        self._gate.stop()
        return self.data_to_send(now_ns)

    def clear(self, now_ns: int) -> None:  # noqa: ARG002
        """Release the emergency stop; the robot drives after a stop was commanded once."""
        self._gate.clear()

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the duty line; it is sent always, as the board holds the last duty without a timeout."""
        return duty_line(*(self._duty if self._may_drive(now_ns) else (0, 0)))

    def _may_drive(self, now_ns: int) -> bool:
        return now_ns - self._ticks_ns < SILENCE_NS and self._gate.may_drive(now_ns)

    def report(self, port: str, now_ns: int) -> DiagnosticStatus:
        """Return the diagnostics of the board, at best a warning."""
        silent = now_ns - self._ticks_ns > SILENCE_NS
        sentences = ["No data from the board."] if silent else []
        sentences.append(f"{NOTICE[0].upper()}{NOTICE[1:]}.")
        known = f"{self._battery}, as the converter reads it; not in volts"
        values = {
            "battery": "unknown" if self._battery is None else known,
            "duties": f"{self._duty[0]} {self._duty[1]}",
            "malformed lines": self._reader.malformed,
        }
        pairs = tuple(KeyValue(key, str(value)) for key, value in values.items())
        return DiagnosticStatus(ERROR if silent else WARN, "board", " ".join(sentences), port, pairs)
