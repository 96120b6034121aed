"""A room, a lidar that measures it, and the line between that lidar and its driver."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.lidar.emulators import LidarEmulator, emulator_of
from chefbot.lidar.models import LIDARS
from chefbot.lidar.revolutions import RevolutionAssembler, Samples

HALF_X, HALF_Y, OPEN = 2.0, 1.2, 0.4
"""Half the sides of the room, m, and half the angle behind, at bearing pi, in which there is no wall, rad."""


def room(bearings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ranges from the middle of the room, inf through the opening."""
    x, y = np.abs(np.cos(bearings)), np.abs(np.sin(bearings))
    walls = np.minimum(HALF_X / np.maximum(x, 1e-9), HALF_Y / np.maximum(y, 1e-9))
    behind = np.abs(np.abs(bearings) - math.pi) < OPEN
    return np.where(behind, math.inf, walls)


class Wire:
    """Emulator and session with a clock, in which bytes take the time that they take on the line."""

    def __init__(self, driver: str) -> None:
        self.model = LIDARS[driver]
        self.lidar: LidarEmulator = emulator_of(driver)
        self.session, self.revolutions = self.model.open(), RevolutionAssembler()
        self.now_ns = 1_000_000_000
        self.sent = b""

    def start(self) -> None:
        """Let the driver send its requests until the lidar scans."""
        for _ in range(100):
            request = self.session.data_to_send(self.now_ns)
            self.sent += request
            answer = self.lidar.receive(request)
            if answer:
                self.session.receive_data(answer, self.now_ns)
            self.now_ns += 50_000_000
            if self.lidar.scanning and not request:
                return
        raise AssertionError("the lidar does not scan")

    def frame(self) -> bytes:
        """Return the next frame; its last sample is measured now."""
        count = self.lidar.samples
        self.now_ns += round(count * 1e9 / self.lidar.sample_rate)
        return self.lidar.next_frame(room)

    def receive(self, data: bytes) -> list[Samples]:
        """Give the driver bytes that began to be sent now, and return the revolutions that they end."""
        later = self.now_ns + round(len(data) * 10 * 1e9 / self.model.baud)
        return [
            revolution
            for part in self.session.receive_data(data, later)
            for revolution in self.revolutions.push(part)
        ]

    def run(self, revolutions: int) -> list[Samples]:
        """Return so many revolutions."""
        found: list[Samples] = []
        while len(found) < revolutions:
            found += self.receive(self.frame())
        return found
