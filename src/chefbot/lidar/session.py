"""Interface of a lidar's protocol."""

from __future__ import annotations

from abc import ABC, abstractmethod

from chefbot.errors import ChefbotError
from chefbot.lidar.revolutions import Samples


class LidarError(ChefbotError):
    """A lidar reports that it is defective."""


class LidarSession(ABC):
    """The session with one lidar since its port was opened: bytes in, requests and samples out."""

    @abstractmethod
    def data_to_send(self, now_ns: int) -> bytes:
        """Return the bytes that are due now, such as requests that start the scan; b"" for none."""

    @abstractmethod
    def receive_data(self, data: bytes, received_ns: int) -> list[Samples]:
        """Return the samples in received bytes, of which the last was received at `received_ns`.

        Raises LidarError if the lidar reports that it is damaged.
        """

    @property
    @abstractmethod
    def damaged(self) -> int:
        """Number of frames with a wrong checksum."""

    @property
    def description(self) -> str:
        """What the lidar has reported about itself, such as model and firmware; empty for nothing."""
        return ""

    def stop_command(self) -> bytes:
        """Return the bytes that end the scan and stop the motor; b"" if the lidar takes no commands."""
        return b""
