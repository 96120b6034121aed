"""RoboClaw motor controllers (Basicmicro) in the mode "packet serial": two motors with encoders and their PID.

Request: address | command | data, big-endian | CRC-16 (polynomial 0x1021, initial value 0) of all bytes before; a
request that only reads has no CRC. Answer to a write: FF. Answer to a read: data | CRC-16 of address, command and
data. Source: RoboClaw series user manual (Basicmicro), commands 14, 21, 24, 37, 55, 78 and 90.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from functools import partial

from chefbot.board.drives.drive_link import MAX_UNATTENDED_SPEED, DriveLink
from chefbot.board.drives.half_duplex import Answer, LineRequest
from chefbot.board.sensors import battery_state
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot

ADDRESS = 0x80
SET_TIMEOUT, VERSION, BATTERY, DRIVE, VELOCITY_PID, ENCODERS, STATUS = 14, 21, 24, 37, 55, 78, 90
ACKNOWLEDGEMENT = b"\xff"
TIMEOUT_TENTHS = 2
"""Time without a request after which the controller stops its motors, 0.1 s."""
PERIOD_NS = 20_000_000
"""Time between two commands of speed, ns."""
STATUS_CYCLES, BATTERY_CYCLES = 10, 50
"""Number of commands of speed after which status and battery are read."""
MAX_ATTEMPTS = 3
"""Requests to set the timeout before the controller counts as one without."""
COUNTER_BITS = 32
MAX_QPPS_ERROR = 0.3
"""Share by which the controller's maximum speed may differ from that of the robot file without a warning."""
ERRORS = {
    0x0001: "its emergency stop input is active",
    0x0002: "it is too hot",
    0x0004: "it is too hot",
    0x0008: "the battery's voltage is too high",
    0x0010: "its logic voltage is too high",
    0x0020: "its logic voltage is too low",
    0x0040: "the driver of motor 1 is damaged",
    0x0080: "the driver of motor 2 is damaged",
    0x0100: "motor 1 does not reach its speed",
    0x0200: "motor 2 does not reach its speed",
    0x1000: "motor 1 takes too much current",
    0x2000: "motor 2 takes too much current",
}
"""Errors in the status of 32 bits, at which the motors are off."""
NO_TIMEOUT = (
    "the RoboClaw does not take a timeout after which it stops its motors; they are limited to a low speed and would"
    " go on turning if this computer failed: update its firmware"
)
UNTUNED = "the RoboClaw's velocity control is not tuned: run Tune Velocity in Basicmicro's Motion Studio"


def crc16(data: bytes) -> bytes:
    """Return the checksum of a packet."""
    return struct.pack(">H", crc_hqx(data, 0))


def write_request(name: str, command: int, data: bytes) -> LineRequest:
    """Return a request that is acknowledged."""
    packet = bytes((ADDRESS, command)) + data
    return LineRequest(name, packet + crc16(packet), lambda _: 1, lambda answer: answer == ACKNOWLEDGEMENT)


def read_request(name: str, command: int, size: int) -> LineRequest:
    """Return a request for so many bytes of data."""
    head = bytes((ADDRESS, command))
    return LineRequest(name, head, lambda _: size + 2, partial(_is_valid, head))


def version_request() -> LineRequest:
    """Return the request for the firmware's version, a text that ends with a line feed and a zero."""
    head = bytes((ADDRESS, VERSION))
    return LineRequest(
        "version",
        head,
        lambda answer: answer.find(b"\n\0") + 4 if b"\n\0" in answer else 0,
        partial(_is_valid, head),
    )


def _is_valid(head: bytes, answer: bytes) -> bool:
    return crc16(head + answer[:-2]) == answer[-2:]


class RoboClawLink(DriveLink):
    """The `MotorBoardLink` of a RoboClaw: motor 1 is the left one, motor 2 the right one.

    The speed is limited until the controller has accepted that it stops its motors when requests end.
    """

    title = "RoboClaw"

    def __init__(self, robot: Robot) -> None:
        self._errors = 0
        self._volts: float | None = None
        self.version = ""
        super().__init__(robot)

    def connection_lost(self) -> None:
        """Reset the link; the controller may be another one after that."""
        super().connection_lost()
        self._cycle, self._driven_ns, self._attempts = 0, -PERIOD_NS, 0
        self._setup = ["version", "pid", "timeout"]
        self._has_timeout, self._qpps = False, -1
        self._due: list[str] = []
        self.gate.max_speed = MAX_UNATTENDED_SPEED / self.robot.wheel_radius

    @property
    def refused(self) -> str | None:
        """Why the controller may not drive: its velocity control is not tuned."""
        return UNTUNED if self._qpps == 0 else None

    @property
    def notice(self) -> str | None:
        """A warning about the controller's timeout or its maximum speed."""
        if self._attempts >= MAX_ATTEMPTS and not self._has_timeout:
            return NO_TIMEOUT
        expected = self.robot.motor.no_load_tick_rate
        if self._qpps > 0 and abs(self._qpps - expected) > MAX_QPPS_ERROR * expected:
            return (
                f"the RoboClaw is tuned for {self._qpps} encoder counts/s at full speed, but the robot file's motor"
                f" has {expected:.0f}"
            )
        return None

    @property
    def problems(self) -> list[str]:
        """Errors in the controller's last status."""
        found = dict.fromkeys(text for bit, text in ERRORS.items() if self._errors & bit)
        return [f"The RoboClaw has switched its motors off: {text}." for text in found]

    @property
    def details(self) -> dict[str, str]:
        """Version of the firmware and battery."""
        volts = "unknown" if self._volts is None else f"{self._volts:.1f} V"
        return {"version": self.version or "unknown", "battery": volts}

    def next_request(self, now_ns: int) -> LineRequest | None:
        """Return the next request of the setup, then speeds and encoders in turn, and status and battery at times."""
        if self._setup:
            return self._setup_request(self._setup[0])
        if self._due:
            return self._read(self._due.pop(0))
        if now_ns - self._driven_ns < PERIOD_NS:
            return None
        self._driven_ns, self._cycle = now_ns, self._cycle + 1
        self._due = ["encoders"]
        self._due += ["status"] if self._cycle % STATUS_CYCLES == 0 else []
        self._due += ["battery"] if self._cycle % BATTERY_CYCLES == 0 else []
        counts = (round(w * self.robot.motor.ticks_per_radian) for w in self.speeds(now_ns))
        return write_request("drive", DRIVE, struct.pack(">2i", *counts))

    def _setup_request(self, step: str) -> LineRequest:
        if step == "version":
            return version_request()
        if step == "pid":
            return read_request("pid", VELOCITY_PID, 16)
        self._attempts += 1
        if self._attempts >= MAX_ATTEMPTS:
            self._setup.clear()  # a controller without this command drives slowly
        return write_request("timeout", SET_TIMEOUT, bytes((TIMEOUT_TENTHS,)))

    @staticmethod
    def _read(name: str) -> LineRequest:
        command, size = {"encoders": (ENCODERS, 8), "status": (STATUS, 4), "battery": (BATTERY, 2)}[name]
        return read_request(name, command, size)

    def process(self, answer: Answer) -> list[Message]:
        """Return the ticks or the battery's state in an answer."""
        data = answer.data[:-2]
        if self._setup and answer.name == self._setup[0]:
            self._setup.pop(0)
        match answer.name:
            case "version":
                self.version = data.split(b"\n")[0].decode("ascii", errors="replace")
            case "pid":
                self._qpps = struct.unpack(">4I", data)[3]
            case "timeout":
                self._has_timeout, self.gate.max_speed = True, self.robot.motor.no_load_speed
            case "encoders":
                left, right = struct.unpack(">2I", data)
                return self.ticks((left, right), COUNTER_BITS, 1.0, answer.stamp_ns)
            case "status":
                self._errors = struct.unpack(">I", data)[0]
            case "battery":
                self._volts = struct.unpack(">H", data)[0] / 10.0
                return [battery_state(answer.stamp_ns, self._volts, self.robot)]
        return []
