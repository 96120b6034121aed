"""Faults of lidar and depth camera at their topics: what a broken cable, driver or clock does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.sim.faults.events import (
    SensorFault,
    SensorFreeze,
    SensorHalfBlind,
    SensorLate,
    SensorNoise,
    SensorOffset,
    SensorStop,
)

M = TypeVar("M", LaserScan, Image)
Ranges = NDArray[np.float32]
CHANGING = (SensorFreeze, SensorNoise, SensorHalfBlind, SensorOffset)
"""Faults that change the ranges of a message."""


@dataclass(eq=False)
class FaultySensor(Generic[M]):
    """A fault injector between a simulated sensor and its topic; without a fault it publishes messages
    unchanged.

    ranges: returns a message's ranges in metres. changed: returns a copy of the message with other ranges.
    front: returns the mask of the ranges that the fault `half_blind` removes.
    """

    publish: Callable[[M], None]
    ranges: Callable[[M], Ranges]
    changed: Callable[[M, Ranges], M]
    front: Callable[[M], NDArray[np.bool_]]
    rng: Generator
    faults: tuple[SensorFault, ...] = ()
    clock_jump_ns: int = 0
    """Time by which the clock that stamps the messages is ahead."""
    _frozen: Ranges | None = None
    _delayed: deque[M] = field(default_factory=deque)

    def send(self, message: M, now_ns: int) -> None:
        """Publish one sensor message, with the active faults applied, at the time of its delivery."""
        if any(isinstance(fault, SensorStop) for fault in self.faults):
            self._delayed.clear()
            return
        frozen = any(isinstance(fault, SensorFreeze) for fault in self.faults)
        if not frozen or self._frozen is None:
            self._frozen = self.ranges(message)
        if any(isinstance(fault, CHANGING) for fault in self.faults):
            message = self.changed(message, self._faulty_ranges(message, self._frozen))
        self._publish_late(message, now_ns)

    def _publish_late(self, message: M, now_ns: int) -> None:
        """Publish the messages that are old enough; those that wait when the fault ends are lost."""
        delays = [fault.seconds for fault in self.faults if isinstance(fault, SensorLate)]
        if not delays:
            self._delayed.clear()
            self.publish(message)
            return
        self._delayed.append(message)
        clock_ns = now_ns + self.clock_jump_ns
        while self._delayed and clock_ns - self._delayed[0].header.stamp.ns >= max(delays) * 1e9:
            self.publish(self._delayed.popleft())

    def _faulty_ranges(self, message: M, ranges: Ranges) -> Ranges:
        for fault in self.faults:
            if isinstance(fault, SensorNoise):
                error = self.rng.standard_normal(ranges.shape, dtype=np.float32)
                ranges = ranges * (1.0 + np.float32(fault.share) * error)
            elif isinstance(fault, SensorOffset):
                ranges = ranges + np.float32(fault.range)
            elif isinstance(fault, SensorHalfBlind):
                ranges = np.where(self.front(message), np.float32(np.nan), ranges)
        return ranges


def faulty_lidar(publish: Callable[[LaserScan], None], rng: Generator) -> FaultySensor[LaserScan]:
    """Return a fault injector for scans; the front half is within 90 degrees of straight ahead."""
    return FaultySensor(
        publish,
        lambda scan: scan.ranges,
        lambda scan, ranges: msgspec.structs.replace(scan, ranges=ranges),
        lambda scan: np.cos(scan.angles) > 0.0,
        rng,
    )


def faulty_camera(publish: Callable[[Image], None], rng: Generator) -> FaultySensor[Image]:
    """Return a fault injector for depth images of float32 metres."""
    return FaultySensor(
        publish,
        lambda image: image.data.view(np.float32).reshape(image.height, image.width),
        lambda image, depth: Image.of(image.header, "32FC1", depth),
        lambda image: np.broadcast_to(np.arange(image.width) < image.width // 2, (image.height, image.width)),
        rng,
    )
