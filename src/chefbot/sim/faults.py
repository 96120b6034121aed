"""Sensor faults injected at the topic of a simulated sensor: what a broken cable, driver or clock does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, Literal, TypeVar, get_args

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.msgs.sensor_msgs import Image, LaserScan

SensorFault = Literal["none", "stop", "freeze", "late", "noise", "half_blind"]
"""Sensor faults: `stop`, no messages; `freeze`, the same data with new stamps; `late`, good data LATE_NS
after their stamp; `noise`, ranges off by NOISE_FRACTION; `half_blind`, no measurement (NaN) in the front half of
a scan or the left half of an image."""
FAULT_DELAY_NS = 1_000_000_000
NOISE_FRACTION = 0.3
"""Standard deviation of the fault `noise`, as a share of the range."""
M = TypeVar("M", LaserScan, Image)
Ranges = NDArray[np.float32]


def parse_fault(name: str) -> SensorFault:
    """Return the fault of a given name. Raises UserError if there is none."""
    for fault in get_args(SensorFault):
        if name == fault:
            return fault
    raise UserError(
        f"There is no sensor fault {name!r}; it must be one of {', '.join(get_args(SensorFault))}"
    )


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
    fault: SensorFault = "none"
    _frozen: Ranges | None = None
    _delayed: deque[M] = field(default_factory=deque)

    def send(self, message: M, now_ns: int) -> None:
        """Publish one sensor message, with the active fault applied, at the time of its delivery."""
        if self.fault == "late":
            self._delayed.append(message)
            while self._delayed and now_ns - self._delayed[0].header.stamp.ns >= FAULT_DELAY_NS:
                self.publish(self._delayed.popleft())
            return
        self._delayed.clear()
        if self.fault != "freeze" or self._frozen is None:
            self._frozen = self.ranges(message)
        if self.fault != "stop":
            self.publish(
                message if self.fault == "none" else self.changed(message, self._faulty_ranges(message))
            )

    def _faulty_ranges(self, message: M) -> Ranges:
        ranges = self.ranges(message)
        if self.fault == "freeze":
            assert self._frozen is not None
            return self._frozen
        if self.fault == "noise":
            error = self.rng.standard_normal(ranges.shape, dtype=np.float32)
            return ranges * (1.0 + np.float32(NOISE_FRACTION) * error)
        return np.where(self.front(message), np.float32(np.nan), ranges)


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
