"""Recording to MCAP with the ros2 profile, readable by rosbag2, Foxglove and other public tools."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import msgspec

from chefbot import __version__
from chefbot.msgs.idl.definition import definition_text
from chefbot.msgs.idl.fields import ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import CompressedImage, Image
from chefbot.robot.spec import Robot
from chefbot.runtime.loop import Publication
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.mcap_writer import McapWriter

IMAGES: tuple[type[Message], ...] = (Image, CompressedImage)
"""Not recorded, as they are 1.5 MB/s and more; a replay uses the scans made from them."""
METADATA = "chefbot"

_QOS = (
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: {durability}\n"
    "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false\n"
)


class Recorder:
    """Writes every publication of a loop to a file: `loop.tap(recorder)`; `close()` completes the file.

    A full disk ends the recording, not the run: the file is completed, and `on_end` is called with the
    reason. `images`: whether images are recorded. `notes`: further records of metadata, by name.
    """

    def __init__(
        self,
        path: Path,
        robot: Robot,
        seed: int,
        *,
        on_end: Callable[[str], None] = lambda _: None,
        images: bool = False,
        notes: Mapping[str, dict[str, str]] = MappingProxyType({}),
    ) -> None:
        self.path = path
        self._on_end = on_end
        self._left_out = () if images else IMAGES
        self._channels: dict[tuple[str, str], int] = {}
        self._counts: dict[int, int] = {}
        self._file = McapWriter(path)
        about = {"robot": msgspec.json.encode(robot).decode(), "seed": str(seed)}
        for name, values in {METADATA: {**about, "version": __version__}, **notes}.items():
            self._file.metadata(name, values)

    def __call__(self, publication: Publication) -> None:
        """Write one publication, but no images unless they are recorded."""
        if self._file.closed or isinstance(publication.message, self._left_out):
            return
        try:
            self._write(publication)
        except StorageError as disk_full:
            self._on_end(str(disk_full))

    def close(self) -> None:
        """Write the index; without it readers must scan the file."""
        self._file.close()

    def _write(self, publication: Publication) -> None:
        channel = self._channel(publication)
        self._counts[channel] = count = self._counts.get(channel, 0) + 1
        time_ns = publication.time_ns
        self._file.add(channel, publication.message.to_cdr(), time_ns, time_ns, count)

    def _channel(self, publication: Publication) -> int:
        key = (publication.topic, publication.publisher)
        if key not in self._channels:
            metadata = {
                "offered_qos_profiles": _QOS.format(durability=1 if publication.latched else 2),
                "publisher": publication.publisher,
                "from_device": str(publication.from_device),
                "latched": str(publication.latched),
            }
            kind = type(publication.message)
            self._channels[key] = self._file.channel(
                "/" + publication.topic, ros_type(kind), definition_text(kind), metadata
            )
        return self._channels[key]
