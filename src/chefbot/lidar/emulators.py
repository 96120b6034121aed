"""Lidars that measure given ranges and send them as real ones do."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.lidar import ld19, rplidar, ydlidar
from chefbot.lidar.models import LIDARS, YDLIDARS
from chefbot.lidar.revolutions import bearings_of
from chefbot.lidar.rplidar_samples import (
    CAPSULES,
    DENSE,
    EXPRESS,
    STANDARD,
    encode_dense,
    encode_express,
    encode_standard,
)

RangesAt = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Returns the ranges (n,), m, inf for nothing, at bearings (n,), rad, in the sensor frame."""


class LidarEmulator(ABC):
    """A lidar on the far end of a serial line.

    revolution_rate: revolutions a second. Every call of `next_frame` takes the next samples of the revolution.
    """

    def __init__(self, sample_rate: float, revolution_rate: float, zero: float = 0.0) -> None:
        self.sample_rate, self.revolution_rate, self._zero = sample_rate, revolution_rate, zero
        self._step = 2.0 * math.pi * revolution_rate / sample_rate
        self.angle = 0.0
        """Angle of the next sample, rad, clockwise."""
        self.scanning = False

    @property
    @abstractmethod
    def samples(self) -> int:
        """Samples of the next frame."""

    @abstractmethod
    def receive(self, data: bytes) -> bytes:
        """Process requests and return the answers."""

    @abstractmethod
    def _encode(self, angles: NDArray[np.float64], ranges: NDArray[np.float64]) -> bytes:
        """Return the frame of samples at angles, clockwise."""

    def next_frame(self, ranges_at: RangesAt) -> bytes:
        """Measure the samples of a frame and return it; b"" while it does not scan."""
        if not self.scanning:
            return b""
        nominal = np.asarray(self.angle + self._step * np.arange(self.samples), np.float64)
        frame = self._encode(nominal, self._measure(nominal, ranges_at))
        self.angle = (self.angle + self._step * len(nominal)) % (2.0 * math.pi)
        return frame

    def _measure(self, angles: NDArray[np.float64], ranges_at: RangesAt) -> NDArray[np.float64]:
        """Return the ranges that the lidar measures for the samples with these angles."""
        return ranges_at(bearings_of(angles, self._zero))


class Ld19Emulator(LidarEmulator):
    """An LD19 or a lidar with its protocol; it scans as soon as it has power."""

    def __init__(self, sample_rate: float, revolution_rate: float = 10.0) -> None:
        super().__init__(sample_rate, revolution_rate)
        self.scanning = True
        self._sent = 0

    @property
    def samples(self) -> int:
        """Number of samples of a frame."""
        return ld19.POINTS

    def receive(self, data: bytes) -> bytes:  # noqa: ARG002 (interface)
        """Ignore all bytes: an LD19 takes no requests."""
        return b""

    def _encode(self, angles: NDArray[np.float64], ranges: NDArray[np.float64]) -> bytes:
        self._sent += 1
        milliseconds = int(1000.0 * self._sent * self.samples / self.sample_rate)
        speed = 2.0 * math.pi * self.revolution_rate
        return ld19.encode(float(angles[0]), float(angles[-1]), ranges, speed, milliseconds)


class YdlidarEmulator(LidarEmulator):
    """An emulated YDLIDAR of a given model."""

    SAMPLES = 40
    """Samples of a packet, but of the first one of a revolution: that has one."""

    def __init__(self, model: ydlidar.YdlidarModel, revolution_rate: float = 7.0) -> None:
        super().__init__(model.sample_rate, revolution_rate)
        self._model, self.scanning = model, model.one_way

    @property
    def samples(self) -> int:
        """Samples up to the end of the revolution, at most SAMPLES."""
        if self.angle < self._step:
            return 1
        return max(1, min(self.SAMPLES, math.ceil((2.0 * math.pi - self.angle) / self._step)))

    def receive(self, data: bytes) -> bytes:
        """Start or stop scanning on request, unless the model is one-way; there are no answers."""
        if not self._model.one_way:
            self.scanning = ydlidar.START in data or (self.scanning and ydlidar.STOP not in data)
        return b""

    def _measure(self, angles: NDArray[np.float64], ranges_at: RangesAt) -> NDArray[np.float64]:
        if not self._model.triangulates:
            return super()._measure(angles, ranges_at)
        # the direction depends on the range that is measured in it
        true, ranges = angles, angles
        for _ in range(6):
            ranges = ranges_at(bearings_of(true, self._zero))
            true = angles + ydlidar.angle_correction(ranges)
        same = np.isclose(ranges_at(bearings_of(true, self._zero)), ranges, rtol=0.0, atol=0.01)
        return np.where(same, ranges, math.inf)  # no return at an edge where the directions contradict

    def _encode(self, angles: NDArray[np.float64], ranges: NDArray[np.float64]) -> bytes:
        first = bool(angles[0] < self._step)
        return ydlidar.encode(self._model, float(angles[0]), float(angles[-1]), ranges, first=first)


class RplidarEmulator(LidarEmulator):
    """An RPLIDAR whose typical mode has data of a type: STANDARD, EXPRESS or DENSE."""

    MODE = 1
    """Number of the typical mode."""

    def __init__(
        self, sample_rate: float, data_type: int, revolution_rate: float = 10.0, model: int = 0x18
    ) -> None:
        super().__init__(sample_rate, revolution_rate, rplidar.ZERO)
        self._type, self._model, self._begins = data_type, model, False
        self.healthy, self.motor = True, True
        self._received = b""

    @property
    def samples(self) -> int:
        """Samples of a packet; eight single samples of the standard format."""
        return 8 if self._type == STANDARD else CAPSULES[self._type].samples

    def receive(self, data: bytes) -> bytes:
        """Execute the complete requests received so far and return their answers."""
        self._received += data
        answers = b""
        while len(self._received) >= 2:
            command = self._received[1]
            size = 2 if not command & 0x80 else 4 + self._received[2] if len(self._received) > 2 else 1000
            if len(self._received) < size:
                break
            payload, self._received = self._received[3 : size - 1], self._received[size:]
            answers += self._answer(command, payload)
        return answers

    def _answer(self, command: int, payload: bytes) -> bytes:
        if command == rplidar.STOP:
            self.scanning = False
        elif command in (rplidar.MOTOR_PWM, rplidar.MOTOR_SPEED):
            self.motor = any(payload)
        elif command == rplidar.GET_INFO:
            content = bytes((self._model, 29, 1, 7)) + bytes(range(16))
            return rplidar.descriptor(20, rplidar.INFO, stream=False) + content
        elif command == rplidar.GET_HEALTH:
            status = rplidar.GOOD if self.healthy else rplidar.DAMAGED
            return rplidar.descriptor(3, rplidar.HEALTH, stream=False) + bytes((status, 7, 0))
        elif command == rplidar.GET_CONFIGURATION:
            return self._setting(int.from_bytes(payload[:4], "little"))
        elif command in (rplidar.SCAN, rplidar.EXPRESS_SCAN):
            self.scanning = self._begins = True
            kind = STANDARD if command == rplidar.SCAN else self._type
            size = 5 if kind == STANDARD else CAPSULES[kind].size
            return rplidar.descriptor(size, kind, stream=True)
        return b""

    def _setting(self, setting: int) -> bytes:
        values = {
            rplidar.TYPICAL_MODE: self.MODE.to_bytes(2, "little"),
            rplidar.ANSWER_TYPE: bytes((self._type,)),
            rplidar.SAMPLE_TIME: round(256e6 / self.sample_rate).to_bytes(4, "little"),
        }
        content = setting.to_bytes(4, "little") + values[setting]
        return rplidar.descriptor(len(content), rplidar.CONFIGURATION, stream=False) + content

    def _encode(self, angles: NDArray[np.float64], ranges: NDArray[np.float64]) -> bytes:
        begins, self._begins = self._begins, False
        if self._type == EXPRESS:
            return encode_express(float(angles[0]), ranges, begins=begins)
        if self._type == DENSE:
            return encode_dense(float(angles[0]), ranges, begins=begins)
        revolution = 2.0 * math.pi
        pairs = zip(angles.tolist(), ranges.tolist(), strict=True)
        return b"".join(
            encode_standard(angle % revolution, metres, first=angle % revolution < self._step)
            for angle, metres in pairs
        )


def emulator_of(driver: str, revolution_rate: float = 10.0) -> LidarEmulator:
    """Return an emulator for a driver of LIDARS that makes so many revolutions a second."""
    if driver in YDLIDARS:
        return YdlidarEmulator(YDLIDARS[driver], revolution_rate)
    if driver.startswith("rplidar"):
        kinds = {
            "rplidar_a1": EXPRESS,
            "rplidar_a2": EXPRESS,
            "rplidar_a2m12": EXPRESS,
            "rplidar_a3": EXPRESS,
        }
        session = LIDARS[driver].open()
        assert isinstance(session, rplidar.RplidarSession)
        return RplidarEmulator(session.sample_rate, kinds.get(driver, DENSE), revolution_rate)
    session = LIDARS[driver].open()
    assert isinstance(session, ld19.Ld19Session)
    return Ld19Emulator(session.sample_rate, revolution_rate)
