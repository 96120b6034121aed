"""Recording to MCAP with the ros2 profile, readable by rosbag2, Foxglove and other public tools."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import msgspec
from mcap.writer import CompressionType, Writer

from chefbot import __version__
from chefbot.errors import UserError
from chefbot.msgs.base import Message, ros_type
from chefbot.msgs.definition import definition_text
from chefbot.msgs.sensor_msgs import CompressedImage, Image
from chefbot.robot.spec import Robot
from chefbot.runtime.loop import Publication

IMAGES: tuple[type[Message], ...] = (Image, CompressedImage)
"""Recorded only on request, being 1.5 MB a second and more; in a replay the scan made of them stands in."""
METADATA = "chefbot"

_QOS = (
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: {durability}\n"
    "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false\n"
)


class Recorder:
    """Writes every publication of a loop: `loop.tap(recorder)`; `close()` makes the file whole."""

    def __init__(self, path: Path, robot: Robot, seed: int, *, images: bool = False) -> None:
        self.path = path
        self._skip = () if images else IMAGES
        self._schemas: dict[type[Message], int] = {}
        self._channels: dict[tuple[str, str], int] = {}
        self._counts: dict[int, int] = {}
        self._file = _open(path)
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=f"chefbot {__version__}")
        about = {"robot": msgspec.json.encode(robot).decode(), "seed": str(seed), "images": str(images)}
        self._writer.add_metadata(METADATA, {**about, "version": __version__})

    def __call__(self, publication: Publication) -> None:
        """Write one publication; images only if asked for."""
        if self._file.closed or isinstance(publication.message, self._skip):
            return
        channel = self._channel(publication)
        self._counts[channel] = self._counts.get(channel, 0) + 1
        try:
            self._writer.add_message(
                channel,
                publication.time_ns,
                publication.message.to_cdr(),
                publication.time_ns,
                self._counts[channel],
            )
        except OSError as error:
            raise UserError(
                f"recording {self.path} stopped: {error.strerror}; free space or record elsewhere"
            ) from None

    def close(self) -> None:
        """Write the index; without it readers must scan the file."""
        try:
            self._writer.finish()
            self._file.close()
        except OSError as error:
            raise UserError(f"recording {self.path} could not be finished: {error.strerror}") from None

    def _channel(self, publication: Publication) -> int:
        key = (publication.topic, publication.publisher)
        if key not in self._channels:
            metadata = {
                "offered_qos_profiles": _QOS.format(durability=1 if publication.latched else 2),
                "publisher": publication.publisher,
                "from_device": str(publication.from_device),
                "latched": str(publication.latched),
            }
            self._channels[key] = self._writer.register_channel(
                "/" + publication.topic, "cdr", self._schema(type(publication.message)), metadata
            )
        return self._channels[key]

    def _schema(self, kind: type[Message]) -> int:
        if kind not in self._schemas:
            text = definition_text(kind).encode()
            self._schemas[kind] = self._writer.register_schema(ros_type(kind), "ros2msg", text)
        return self._schemas[kind]


def _open(path: Path) -> BinaryIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("wb")
    except OSError as error:
        raise UserError(f"cannot record to {path}: {error.strerror}") from None
