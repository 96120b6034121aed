"""The chapter's own board: duties instead of speeds, no CRC, and nothing that stops it when we fall silent.

So wheel speeds are controlled here, slowly: should this program die, the motors keep the last duty.
"""

from __future__ import annotations

import math

import numpy as np

from chefbot.board.chapter_messages import (
    DUTY_FULL,
    EDGES,
    ChapterAttitude,
    ChapterBattery,
    ChapterEcho,
    ChapterLine,
    ChapterReader,
    ChapterTicks,
    ChapterTime,
    duty_line,
)
from chefbot.board.clock_sync import BoardTime
from chefbot.board.counter_unwrap import signed
from chefbot.board.sensors import range_message
from chefbot.board.wheel_pid import WheelPid
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, WARN, DiagnosticStatus, KeyValue
from chefbot.msgs.geometry_msgs import Quaternion
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import UNKNOWN_COVARIANCE, Imu
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot

SPEED_CAP = 0.15
"""m/s of either rim: what the chapter's board may do, as nothing but a hand on the switch stops it."""
FRESH_NS = 100_000_000
"""An older command is a stop."""
SILENCE_NS = 300_000_000
"""Without ticks for so long nobody knows what the wheels do: stop."""
ATTITUDE_DEVIATION = 0.01
"""rad; a component of the quaternion is off by 0.005 at most, the angle by twice that."""
BELIEVED = 1.5
"""Ticks of so many times the motor's speed without load are damage, not motion."""
NOTICE = (
    "this is the chapter's own firmware: no checksum, no watchdog, no volts; its wheels are limited to "
    f"{SPEED_CAP} m/s and would go on turning if this computer failed: flash ours, with `chefbot flash`"
)


class ChapterLink:
    """See Link. Ticks are told in those of the robot file: four to each of the board's."""

    refused: str | None = None
    notice: str | None = NOTICE

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._reader = ChapterReader()
        self._pids = (WheelPid(robot), WheelPid(robot))
        self._fastest = BELIEVED * robot.motor.no_load_speed * robot.motor.ticks_per_turn / (2.0 * math.pi)
        self._battery: int | None = None
        self._stopped = False
        self.lost_line()

    def lost_line(self) -> None:
        """What was commanded is gone, and so is what was known of the board's counters; a stop remains."""
        self._reader.clear()
        self._target: tuple[float, float] = (0.0, 0.0)
        self._commanded_ns = self._ticks_ns = -(1 << 62)
        self._duty = (0, 0)
        self._neutral_first = True
        self._forget_board()

    def _forget_board(self) -> None:
        self._time: BoardTime | None = None
        self._board_us = self._stamp_ns = 0
        self._ticks: tuple[int, int] | None = None
        self._ticks_us = 0
        self._doubted = False
        for pid in self._pids:
            pid.reset()

    # -- from the board

    def hear(self, data: bytes, now_ns: int) -> list[Message]:
        """Messages of well-formed lines; those before the first `t` line have no time and are left out."""
        messages: list[Message] = []
        for line in self._reader.read(data):
            if isinstance(line, ChapterTime):
                self._hear_time(line.t, now_ns)
            elif self._time is not None:
                messages += self._hear_line(line, now_ns)
        return messages

    def _hear_time(self, t_us: int, now_ns: int) -> None:
        if self._time is not None:
            full_us = self._time.unwrap(t_us, now_ns)
            if full_us < self._board_us or abs(self._time.late_ns(full_us, now_ns)) > SILENCE_NS * 10:
                self._forget_board()  # it has restarted
        if self._time is None:
            self._time, self._board_us = BoardTime(t_us, now_ns), t_us
        self._board_us = self._time.unwrap(t_us, now_ns)
        self._stamp_ns = self._time.stamp(self._board_us, now_ns)

    def _hear_line(self, line: ChapterLine, now_ns: int) -> list[Message]:
        if isinstance(line, ChapterTicks):
            return self._hear_ticks(EDGES * line.left, EDGES * line.right, now_ns)
        if isinstance(line, ChapterEcho) and self._robot.sensors.ultrasonic is not None:
            distance = line.centimetres / 100.0 if line.centimetres else math.inf
            return [range_message(self._stamp_ns, distance, self._robot)]
        if isinstance(line, ChapterAttitude):
            return self._attitude(line)
        if isinstance(line, ChapterBattery):
            self._battery = line.raw
        return []

    def _hear_ticks(self, left: int, right: int, now_ns: int) -> list[Message]:
        before, dt = self._ticks, (self._board_us - self._ticks_us) / 1e6
        if before is not None and dt <= 0.0:
            return []
        if before is not None:
            bits = 32 + EDGES.bit_length() - 1
            moved = (signed(left - before[0], bits), signed(right - before[1], bits))
            if max(map(abs, moved)) > self._fastest * dt + EDGES:
                return self._doubt()
            left, right = before[0] + moved[0], before[1] + moved[1]
            self._control(moved, dt, now_ns)
        self._ticks, self._ticks_us, self._ticks_ns, self._doubted = (
            (left, right),
            self._board_us,
            now_ns,
            False,
        )
        return [WheelTicks(Header.of(self._stamp_ns, "base_link"), left, right)]

    def _doubt(self) -> list[Message]:
        """Once is damage, twice in a row is a board that has restarted."""
        if self._doubted:
            self._forget_board()
        else:
            self._doubted = True
        return []

    def _control(self, moved: tuple[int, int], dt: float, now_ns: int) -> None:
        target = self._target if self._may_drive(now_ns) else (0.0, 0.0)
        duties = (
            pid.update(speed / self._robot.wheel_radius, ticks, dt)
            for pid, speed, ticks in zip(self._pids, target, moved, strict=True)
        )
        left, right = (round(DUTY_FULL * duty) for duty in duties)
        self._duty = (left, right)

    def _attitude(self, line: ChapterAttitude) -> list[Message]:
        values = np.array([line.x, line.y, line.z, line.w])
        size = float(np.linalg.norm(values))
        if abs(size - 1.0) > 0.05:
            return []
        return [
            Imu(
                header=Header.of(self._stamp_ns, "imu_link"),
                orientation=Quaternion(*(values / size).tolist()),
                orientation_covariance=(ATTITUDE_DEVIATION**2 * np.eye(3)).reshape(9),
                angular_velocity_covariance=UNKNOWN_COVARIANCE,
                linear_acceleration_covariance=UNKNOWN_COVARIANCE,
            )
        ]

    # -- to the board

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """Rim speeds in m/s, both scaled down alike to SPEED_CAP; the duty follows with the next ticks."""
        if not (math.isfinite(left) and math.isfinite(right)):
            return b""
        scale = min(1.0, SPEED_CAP / max(abs(left), abs(right), SPEED_CAP))
        self._neutral_first = self._neutral_first and (left, right) != (0.0, 0.0)
        self._target, self._commanded_ns = (left * scale, right * scale), now_ns
        return b""

    def stop(self, now_ns: int) -> bytes:
        """Duty 0, which brakes."""
        self._stopped = True
        return self.speak(now_ns)

    def clear(self, now_ns: int) -> None:  # noqa: ARG002
        """It may drive again after a stop was commanded."""
        self._stopped, self._neutral_first = False, True

    def speak(self, now_ns: int) -> bytes:
        """The duty; always, for the board holds the last one for ever."""
        return duty_line(*(self._duty if self._may_drive(now_ns) else (0, 0)))

    def _may_drive(self, now_ns: int) -> bool:
        fresh = now_ns - self._commanded_ns < FRESH_NS and now_ns - self._ticks_ns < SILENCE_NS
        return fresh and not self._stopped and not self._neutral_first

    def report(self, port: str, now_ns: int) -> DiagnosticStatus:
        """Never better than a warning."""
        silent = now_ns - self._ticks_ns > SILENCE_NS
        sentences = ["The board says nothing."] if silent else []
        sentences.append(f"{NOTICE[0].upper()}{NOTICE[1:]}.")
        raw = (
            "unknown"
            if self._battery is None
            else f"{self._battery}, as the converter reads it; not in volts"
        )
        values = {
            "battery": raw,
            "duties": f"{self._duty[0]} {self._duty[1]}",
            "strange lines": self._reader.strange,
        }
        told = tuple(KeyValue(key, str(value)) for key, value in values.items())
        return DiagnosticStatus(ERROR if silent else WARN, "board", " ".join(sentences), port, told)
