"""Motor drives with a controller of their own, as far as their bytes show: speeds in, encoders out."""

from __future__ import annotations

import math
import struct

from chefbot.board.drives import ddsm115, roboclaw
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
LAG = 0.08
"""Time constant of a motor with its speed control, s."""


class Motors:
    """Two wheels of first order, which stop when no command has come for `timeout` seconds, if they have one."""

    def __init__(self) -> None:
        self.wanted, self.speed, self.angle = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.timeout, self._age = math.inf, 0.0

    def command(self, wheel: int, speed: float) -> None:
        self.wanted[wheel], self._age = speed, 0.0

    def turn(self, seconds: float) -> None:
        self._age += seconds
        if self._age > self.timeout:
            self.wanted = [0.0, 0.0]
        for wheel in (0, 1):
            share = 1.0 - math.exp(-seconds / LAG)
            self.speed[wheel] += (self.wanted[wheel] - self.speed[wheel]) * share
            self.angle[wheel] += self.speed[wheel] * seconds


class EmulatedRoboClaw:
    """A RoboClaw; `knows_timeout` is false of an old firmware, `qpps` is 0 before it was tuned."""

    def __init__(self) -> None:
        self.motors = Motors()
        self.qpps, self.status, self.volts = round(ROBOT.motor.no_load_tick_rate), 0, 12.3
        self.knows_timeout = True
        self.received: list[int] = []
        self._buffer = b""
        self._offset = 4_294_960_000  # the counters wrap soon

    def turn(self, seconds: float) -> bytes:
        self.motors.turn(seconds)
        return b""  # it sends nothing by itself

    def receive(self, data: bytes) -> bytes:
        self._buffer += data
        answer = b""
        while (part := self._step()) is not None:
            answer += part
        return answer

    def _step(self) -> bytes | None:
        if len(self._buffer) < 2:
            return None
        address, command = self._buffer[:2]
        size = {roboclaw.DRIVE: 12, roboclaw.SET_TIMEOUT: 5}.get(command, 2)
        if address != roboclaw.ADDRESS:
            self._buffer = self._buffer[1:]
            return b""
        if len(self._buffer) < size:
            return None
        packet, self._buffer = self._buffer[:size], self._buffer[size:]
        self.received.append(command)
        return self._write(packet) if size > 2 else self._read(command)

    def _write(self, packet: bytes) -> bytes:
        if roboclaw.crc16(packet[:-2]) != packet[-2:]:
            return b""
        if packet[1] == roboclaw.SET_TIMEOUT:
            if not self.knows_timeout:
                return b""
            self.motors.timeout = packet[2] / 10.0
        else:
            for wheel, counts in enumerate(struct.unpack(">2i", packet[2:-2])):
                self.motors.command(wheel, counts / ROBOT.motor.ticks_per_radian)
        return roboclaw.ACKNOWLEDGEMENT

    def _read(self, command: int) -> bytes:
        counts = [self.counts(wheel) % 2**32 for wheel in (0, 1)]
        data = {
            roboclaw.VERSION: b"USB Roboclaw 2x15a v4.2.4\n\0",
            roboclaw.BATTERY: struct.pack(">H", round(10.0 * self.volts)),
            roboclaw.VELOCITY_PID: struct.pack(">4I", 1, 2, 3, self.qpps),
            roboclaw.ENCODERS: struct.pack(">2I", *counts),
            roboclaw.STATUS: struct.pack(">I", self.status),
        }.get(command, b"")
        return data + roboclaw.crc16(bytes((roboclaw.ADDRESS, command)) + data) if data else b""

    def counts(self, wheel: int) -> int:
        return self._offset + math.floor(self.motors.angle[wheel] * ROBOT.motor.ticks_per_radian)


class EmulatedDdsm115:
    """Two motors on one line, the second one mounted the other way round."""

    def __init__(self) -> None:
        self.motors = Motors()
        self.errors, self.mode = [0, 0], [1, 1]  # they are switched on in another mode
        self._buffer = b""

    def turn(self, seconds: float) -> bytes:
        self.motors.turn(seconds)
        return b""

    def receive(self, data: bytes) -> bytes:
        self._buffer += data
        answer = b""
        while len(self._buffer) >= ddsm115.LENGTH:
            frame, self._buffer = self._buffer[: ddsm115.LENGTH], self._buffer[ddsm115.LENGTH :]
            answer += self._process(frame)
        return answer

    def _process(self, frame: bytes) -> bytes:
        if frame[0] not in ddsm115.IDS:
            return b""
        wheel = ddsm115.IDS.index(frame[0])
        if frame[1] == ddsm115.MODE:
            self.mode[wheel] = frame[9]
            return b""
        if frame[1] != ddsm115.SPEED or ddsm115.crc8(frame[:-1]) != frame[-1]:
            return b""
        sign, rpm = ddsm115.FORWARD_SIGNS[wheel], struct.unpack(">h", frame[2:4])[0]
        if self.mode[wheel] == ddsm115.VELOCITY_MODE:
            self.motors.command(wheel, sign * rpm * 2.0 * math.pi / 60.0)
        turns = sign * self.motors.angle[wheel] / (2.0 * math.pi)
        position = math.floor(turns * ddsm115.COUNTS_PER_TURN)
        speed = round(sign * self.motors.speed[wheel] * 60.0 / (2.0 * math.pi))
        counts = position % ddsm115.COUNTS_PER_TURN
        body = ddsm115.ANSWER.pack(frame[0], self.mode[wheel], 0, speed, counts, self.errors[wheel], 0)[:-1]
        return body + bytes((ddsm115.crc8(body),))


EMULATORS = {"roboclaw": EmulatedRoboClaw, "ddsm115": EmulatedDdsm115}
