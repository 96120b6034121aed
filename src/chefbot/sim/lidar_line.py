"""The simulated lidar behind its serial line: what its driver decodes are the bytes of an emulated model."""

from __future__ import annotations

from collections import deque
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chefbot.lidar.emulators import emulator_of
from chefbot.lidar.laser_scan import scan_of
from chefbot.lidar.models import LIDARS
from chefbot.lidar.own_body import OwnBody
from chefbot.lidar.revolutions import RevolutionAssembler, Samples
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.sim.lidar import Floats, RotatingLidar

BITS_PER_BYTE = 10
"""Bits on the line per byte: start, eight data bits, stop."""


class EmulatedLidar:
    """An emulated model that measures the simulated world, and takes as long for its bytes as its line does."""

    def __init__(self, driver: str, rotating: RotatingLidar, now_ns: int) -> None:
        self._rotating, self.model = rotating, LIDARS[driver]
        self._lidar = emulator_of(driver, rotating.lidar.rate)
        self._sampled_ns = float(now_ns)
        self._line_free_ns = float(now_ns)
        self._sent: deque[tuple[int, bytes]] = deque()

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take requests, whose answers follow."""
        answer = self._lidar.receive(data) if data else b""
        if answer:
            self._send(answer, now_ns)

    def bytes_until(self, now_ns: int) -> list[tuple[int, bytes]]:
        """Measure up to a time, ns; return what has arrived by then, with the times of the last bytes."""
        period_ns = 1e9 / self._lidar.sample_rate
        while self._sampled_ns + self._lidar.samples * period_ns <= now_ns:
            times = self._sampled_ns + period_ns * (1.0 + np.arange(self._lidar.samples))
            frame = self._lidar.next_frame(partial(self._measure, times.astype(np.int64)))
            self._sampled_ns = float(times[-1])
            if frame:
                self._send(frame, self._sampled_ns)
        arrived = []
        while self._sent and self._sent[0][0] <= now_ns:
            arrived.append(self._sent.popleft())
        return arrived

    def _send(self, data: bytes, now_ns: float) -> None:
        """Send bytes as soon as the line has sent those before."""
        line_ns = len(data) * BITS_PER_BYTE * 1e9 / self.model.baud
        self._line_free_ns = max(self._line_free_ns, now_ns) + line_ns
        self._sent.append((round(self._line_free_ns), data))

    def _measure(self, times_ns: NDArray[np.int64], bearings: Floats) -> Floats:
        ranges = self._rotating.measure(bearings, times_ns)
        return np.where(ranges > self._rotating.lidar.range_max, np.inf, ranges)


class LidarLine:
    """An emulated lidar with the driver's half of the line: requests, decoding, revolutions and scans."""

    def __init__(self, driver: str, rotating: RotatingLidar, now_ns: int) -> None:
        self._rotating, self._lidar = rotating, EmulatedLidar(driver, rotating, now_ns)
        self._session, self._revolutions = self._lidar.model.open(), RevolutionAssembler()
        self._own_body = OwnBody(rotating.lidar, rotating.footprint)

    def advance(self, now_ns: int) -> list[LaserScan]:
        """Let the lidar and its driver run up to a time, ns; return the scans of the revolutions that ended."""
        self._lidar.receive(self._session.data_to_send(now_ns), now_ns)
        parts: list[Samples] = []
        for received_ns, data in self._lidar.bytes_until(now_ns):
            parts += self._session.receive_data(data, received_ns)
        revolutions = [revolution for part in parts for revolution in self._revolutions.push(part)]
        return [
            scan_of(revolution, self._rotating.lidar, self._own_body, "laser") for revolution in revolutions
        ]
