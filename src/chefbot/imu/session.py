"""Interface of the protocol of an IMU on a serial line."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

Triple = tuple[float, float, float]
UNMEASURED_VARIANCE = 1.0
"""Variance of an angular rate that is not measured, rad^2/s^2."""
STANDARD_GRAVITY = 9.80665
"""Acceleration in the unit g, m/s^2."""


class ImuSample(NamedTuple):
    """One sample in the axes of the sensor.

    stamp_ns: time of the measurement. rates: mean angular velocity since the sample before, rad/s. rates_variance: of
    the resolution alone, without the sensor's noise; UNMEASURED_VARIANCE for an axis that is not measured.
    acceleration: specific force, +9.8 upwards at rest, m/s^2.
    """

    stamp_ns: int
    rates: Triple
    rates_variance: Triple
    acceleration: Triple


class ImuSession(ABC):
    """The session with one IMU since its port was opened: bytes in, requests and samples out."""

    @abstractmethod
    def data_to_send(self, now_ns: int) -> bytes:
        """Return the bytes that configure the sensor, when they are due; b"" for none."""

    @abstractmethod
    def receive_data(self, data: bytes, received_ns: int) -> list[ImuSample]:
        """Return the samples in received bytes, of which the last was received at `received_ns`."""

    @property
    @abstractmethod
    def damaged(self) -> int:
        """Number of frames with a wrong checksum."""

    @property
    def description(self) -> str:
        """What the IMU has reported about itself: nothing."""
        return ""
