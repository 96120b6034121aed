"""RPLIDAR of all serial models: requests, answers, and the scan in the lidar's typical mode.

Request: A5 command, or A5 command size payload checksum (exclusive or of all before). Answer: a descriptor of 7
bytes, A5 5A, u32 of which the low 30 bits are the size of a packet and the others 1 for a stream, and the type.
Source: Slamtec's rplidar_sdk at 99478e5.
"""

from __future__ import annotations

import struct
from functools import reduce
from operator import xor
from typing import NamedTuple

import numpy as np

from chefbot.byte_frames import ByteFrame, FrameFormat, Framer
from chefbot.lidar.revolutions import Samples, bearings_of
from chefbot.lidar.rplidar_samples import (
    CAPSULES,
    FULL_TURN,
    GROUP,
    HQ,
    SAMPLE_SIZE,
    STANDARD,
    Angles,
    Ranges,
    decode_standard,
    find_capsule,
    has_valid_checksum,
    is_standard,
    start_angle,
)
from chefbot.lidar.session import LidarError, LidarSession

SYNC, STREAM = 0xA5, 1 << 30
STOP, RESET, SCAN, EXPRESS_SCAN = 0x25, 0x40, 0x20, 0x82
GET_INFO, GET_HEALTH, GET_CONFIGURATION = 0x50, 0x52, 0x84
MOTOR_PWM, MOTOR_SPEED = 0xF0, 0xA8
"""Commands."""
INFO, HEALTH, CONFIGURATION = 0x04, 0x06, 0x20
"""Types of single answers."""
SAMPLE_TIME, ANSWER_TYPE, TYPICAL_MODE = 0x71, 0x75, 0x7C
"""Settings that GET_CONFIGURATION reads: 1/256 us u32, type of data u8, both of a mode; the mode u16."""
GOOD, DAMAGED = 0, 2
"""Status of health; between them is a warning."""
BUILT_IN_SPEED = 6
"""Series, the high nibble of the model, from which a lidar controls its speed itself; C1, series 4, does as well."""
C_SERIES = 4
USUAL_PWM, USUAL_RPM = 660, 600
"""Speed of the motor: PWM of the adapters of A2 and A3, revolutions a minute of the others."""
DESCRIPTOR = struct.Struct("<BBIB")
ANSWER_PATIENCE_NS = 500_000_000
"""Time to wait for an answer, ns; without one the next step follows: old firmware does not know all requests."""
SILENCE_NS = 2_000_000_000
"""Time without samples after which everything begins again, ns."""
MAX_ANSWER = 256
"""Size of the largest single answer, bytes."""
MAX_REVOLUTION_RATE = 20.0
"""Revolutions a second that no lidar makes: capsules whose angles would need more do not belong together."""
ZERO = np.pi
"""Bearing of the lidar's zero mark: Slamtec's ROS driver has x pointing away from it, to the cable's side."""


def request(command: int, payload: bytes = b"") -> bytes:
    """Return a request; one with bit 7 set has a size, a payload and a checksum."""
    head = bytes((SYNC, command))
    if not command & 0x80:
        return head
    body = head + bytes((len(payload),)) + payload
    return body + bytes((reduce(xor, body),))


def descriptor(size: int, kind: int, *, stream: bool) -> bytes:
    """Return the descriptor of an answer with packets of `size` bytes."""
    return DESCRIPTOR.pack(SYNC, 0x5A, size | (STREAM if stream else 0), kind)


class ScanMode(NamedTuple):
    """A mode of scanning: its number, the type of its data, and the time between two samples, ns."""

    number: int
    data_type: int
    sample_ns: float


class RplidarSession(LidarSession):
    """Requests model, health and typical mode, starts the scan in that mode, and decodes its packets.

    baud: of the line. sample_ns: time between two samples where the lidar does not report it, ns.
    """

    def __init__(self, baud: int, sample_ns: float) -> None:
        self._baud = baud
        self._mode = ScanMode(0, STANDARD, sample_ns)
        self._model, self._description = -1, ""
        self._answers = bytearray()
        self._framer: Framer | None = None
        self._previous: ByteFrame | None = None
        self._damaged = 0
        self._sampled_ns = self._requested_ns = -1
        self._steps = [*self._SETUP]

    _SETUP = ("stop", "info", "health", "typical mode", "data type", "sample time", "motor", "scan")
    """What is done after the port was opened, in this order."""

    @property
    def sample_rate(self) -> float:
        """Samples a second, of the mode as far as it is known."""
        return 1e9 / self._mode.sample_ns

    @property
    def description(self) -> str:
        """Model, firmware and serial number, once the lidar has reported them."""
        return self._description

    @property
    def damaged(self) -> int:
        """Number of packets with a wrong checksum."""
        return self._damaged + (self._framer.damaged if self._framer is not None else 0)

    def stop_command(self) -> bytes:
        """Return the requests that end the scan and stop the motor."""
        return request(STOP) + self._motor(0, 0)

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the next request: each waits for the answer to the previous one, or for its timeout."""
        if not self._steps and now_ns - max(self._sampled_ns, self._requested_ns) > SILENCE_NS:
            self._steps = [*self._SETUP]  # it was switched off and on
            self._requested_ns = -1
        if not self._steps or (self._requested_ns >= 0 and now_ns - self._requested_ns < ANSWER_PATIENCE_NS):
            return b""
        step = self._steps.pop(0)
        self._requested_ns = now_ns
        if step in ("stop", "scan"):
            self._framer = self._previous = None
            self._answers.clear()
        return self._request_of(step)

    def _request_of(self, step: str) -> bytes:
        mode = struct.pack("<H", self._mode.number)
        if step == "scan":
            if self._mode.data_type == STANDARD:
                return request(SCAN)
            return request(EXPRESS_SCAN, mode[:1] + b"\0\0\0\0")
        return {
            "stop": request(STOP),
            "info": request(GET_INFO),
            "health": request(GET_HEALTH),
            "typical mode": request(GET_CONFIGURATION, struct.pack("<I", TYPICAL_MODE)),
            "data type": request(GET_CONFIGURATION, struct.pack("<I", ANSWER_TYPE) + mode),
            "sample time": request(GET_CONFIGURATION, struct.pack("<I", SAMPLE_TIME) + mode),
            "motor": self._motor(USUAL_PWM, USUAL_RPM),
        }[step]

    def _motor(self, pwm: int, rpm: int) -> bytes:
        """Return the request for a speed of the motor; those that do not know it ignore it."""
        series = self._model >> 4
        if series == C_SERIES or series >= BUILT_IN_SPEED:
            return request(MOTOR_SPEED, struct.pack("<H", rpm))
        return request(MOTOR_PWM, struct.pack("<H", pwm))

    def receive_data(self, data: bytes, received_ns: int) -> list[Samples]:
        """Take the answers, and return the samples of a running scan; raises LidarError if the lidar is damaged."""
        if self._framer is None:
            self._answers += data
            data = self._take_answers()
        if self._framer is None or not data:
            return []
        parts = (self._decode(frame) for frame in self._framer.push(data, received_ns))
        samples = [part for part in parts if part is not None]
        if samples:
            self._sampled_ns = received_ns
        return samples

    def _take_answers(self) -> bytes:
        """Take all whole answers; return what follows the descriptor of a stream."""
        buffer = self._answers
        while (begin := buffer.find(bytes((SYNC, 0x5A)))) >= 0 and len(buffer) >= begin + DESCRIPTOR.size:
            _, _, word, kind = DESCRIPTOR.unpack_from(buffer, begin)
            size, content = word & (STREAM - 1), begin + DESCRIPTOR.size
            if word & STREAM:
                rest = bytes(buffer[content:])
                buffer.clear()
                return rest if self._start_stream(kind, size) else b""
            if size > MAX_ANSWER:
                del buffer[: begin + 1]  # no answer: a damaged descriptor
                continue
            if len(buffer) < content + size:
                break
            self._take_answer(kind, bytes(buffer[content : content + size]))
            del buffer[: content + size]
        return b""

    def _take_answer(self, kind: int, content: bytes) -> None:
        self._requested_ns = -1  # the next request may follow
        if kind == INFO and len(content) == 20:
            self._model = content[0]
            firmware = f"{content[2]}.{content[1]:02d}"
            self._description = (
                f"model 0x{content[0]:02x}, firmware {firmware}, serial number {content[4:].hex()}"
            )
        elif kind == HEALTH and len(content) == 3 and content[0] == DAMAGED:
            code = int.from_bytes(content[1:], "little")
            raise LidarError(f"the lidar reports a fault, code {code}: switch it off and on")
        elif kind == CONFIGURATION and len(content) > 4:
            self._take_setting(int.from_bytes(content[:4], "little"), int.from_bytes(content[4:8], "little"))

    def _take_setting(self, setting: int, value: int) -> None:
        if setting == TYPICAL_MODE:
            self._mode = self._mode._replace(number=value & 0xFFFF)
        elif setting == ANSWER_TYPE:
            self._mode = self._mode._replace(data_type=value & 0xFF)
        elif setting == SAMPLE_TIME and value:
            self._mode = self._mode._replace(sample_ns=value / 256.0 * 1000.0)

    def _start_stream(self, kind: int, size: int) -> bool:
        """Prepare for packets of a type; return whether it is known."""
        if kind == STANDARD and size == SAMPLE_SIZE:
            group = GROUP * SAMPLE_SIZE
            layout = FrameFormat(lambda b, at: at if at < len(b) else -1, lambda _b, _at: group, is_standard)
        elif kind in CAPSULES and CAPSULES[kind].size == size:
            layout = FrameFormat(find_capsule, lambda _b, _at: size, has_valid_checksum)
        else:
            name = "HQ" if kind == HQ else f"0x{kind:02x}"
            raise LidarError(
                f"the lidar sends data of type {name} in packets of {size} bytes, which is not known here"
            )
        self._framer, self._previous = Framer(layout, self._baud), None
        self._mode = self._mode._replace(data_type=kind)
        return True

    def _decode(self, frame: ByteFrame) -> Samples | None:
        """Return the samples of a packet, or of the capsule before it."""
        if self._mode.data_type == STANDARD:
            return self._samples(*decode_standard(frame.data), frame.began_ns)
        capsule = CAPSULES[self._mode.data_type]
        previous, self._previous = self._previous, frame
        begins = frame.data[capsule.angle_at + 1] & 0x80
        if previous is None or begins or not frame.follows:
            return None  # the one before does not continue in this one
        span = (
            start_angle(frame.data, capsule.angle_at) - start_angle(previous.data, capsule.angle_at)
        ) % FULL_TURN
        if span > MAX_REVOLUTION_RATE * FULL_TURN * capsule.samples * self._mode.sample_ns / 1e9:
            return None
        return self._samples(*capsule.decode(previous.data, frame.data), previous.began_ns)

    def _samples(self, angles: Angles, ranges: Ranges, began_ns: int) -> Samples:
        # the last sample was taken when the packet began on the line
        ages = np.rint(np.arange(len(angles) - 1, -1, -1) * self._mode.sample_ns).astype(np.int64)
        return Samples(bearings_of(angles, ZERO), ranges, began_ns - ages)
