"""A bag writer: rosbag2's folder with an MCAP file and metadata.yaml, or a single MCAP file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import yaml

from chefbot.msgs.idl.definition import definition_text
from chefbot.msgs.idl.registry import message_type
from chefbot.ros2.bag.errors import BagError
from chefbot.ros2.bag.qos_profile import qos_profiles_to_yaml, qos_to_profile
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import QoS
from chefbot.storage.atomic_files import write_atomic
from chefbot.storage.mcap_writer import McapWriter

VERSION = 9
"""Version of metadata.yaml, as written by rosbag2 of Jazzy and Kilted."""
DISTRO = "jazzy"
"""Distribution whose message definitions ours are, unless the environment names another."""
NEVER_NS = 2**63 - 1
"""Start time of a bag without messages (rosbag2)."""
METADATA_FILE, METADATA_RECORD = "metadata.yaml", "rosbag2"
METADATA_RESERVE = 2000
"""Bytes reserved for the metadata; the same for each topic, plus its QoS profiles."""


class _Topic:
    """A topic with one type, its channel and its message count."""

    def __init__(self, name: str, kind: InterfaceType, channel: int, offers: list[QoS]) -> None:
        self.name, self.kind, self.channel, self.offers = name, kind, channel, offers
        self.count = 0


class BagWriter:
    """A writer of CDR messages to a bag; `out` is a new folder, or a file NAME.mcap.

    Raises BagError when it exists already or cannot be written.
    """

    def __init__(self, out: Path) -> None:
        self.out = out
        self._folder = None if out.suffix == ".mcap" else out
        self.path = out if self._folder is None else out / f"{out.name}_0.mcap"
        if out.exists():
            raise BagError(f"{out} exists already; choose another -o, bags are never overwritten")
        self._file = McapWriter(self.path, self._last_record)
        self._file.reserve(METADATA_RESERVE)
        self._topics: dict[tuple[str, InterfaceType], _Topic] = {}
        self._first_ns, self._last_ns = NEVER_NS, 0

    @property
    def counts(self) -> dict[str, int]:
        """Number of messages of each topic."""
        counts: dict[str, int] = {}
        for topic in self._topics.values():
            counts[topic.name] = counts.get(topic.name, 0) + topic.count
        return counts

    def add_topic(self, name: str, kind: InterfaceType, offers: list[QoS]) -> None:
        """Add a topic before its first message.

        `offers` are the QoS of its publishers, used by players of the bag.
        """
        if (name, kind) in self._topics:
            return
        metadata = {"offered_qos_profiles": qos_profiles_to_yaml(offers), "topic_type_hash": kind.hash}
        self._file.reserve(
            METADATA_RESERVE + 2 * len(metadata["offered_qos_profiles"]) + len(name) + len(kind.name)
        )
        channel = self._file.channel(name, kind.name, _definition(kind), metadata)
        self._topics[name, kind] = _Topic(name, kind, channel, offers)

    def add(self, name: str, kind: InterfaceType, data: bytes, received_ns: int, published_ns: int) -> None:
        """Add one message with the times at which it was received and published, ns since the epoch."""
        topic = self._topics[name, kind]
        self._file.add(topic.channel, data, received_ns, published_ns, topic.count + 1)
        topic.count += 1
        self._first_ns, self._last_ns = min(self._first_ns, received_ns), max(self._last_ns, received_ns)

    def flush(self) -> None:
        """Flush to the file, so that the messages so far survive even if this process is killed."""
        self._file.flush()

    def close(self) -> None:
        """Finish the bag; also works after `add` has raised because the disk is full."""
        self._file.close()
        if self._folder is not None:
            text = _yaml({"rosbag2_bagfile_information": self._metadata()})
            write_atomic(self._folder / METADATA_FILE, text.encode())

    def _last_record(self) -> tuple[str, dict[str, str]]:
        return METADATA_RECORD, {"serialized_metadata": _yaml(self._metadata())}

    def _metadata(self) -> dict[str, Any]:
        duration = {"nanoseconds": max(0, self._last_ns - self._first_ns)}
        start = {"nanoseconds_since_epoch": self._first_ns}
        count = sum(topic.count for topic in self._topics.values())
        name = self.path.name
        return {
            "version": VERSION,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": count,
            "topics_with_message_count": [_topic_metadata(topic) for topic in self._topics.values()],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [name],
            "files": [
                {
                    "path": name,
                    "starting_time": dict(start),
                    "duration": dict(duration),
                    "message_count": count,
                }
            ],
            "custom_data": None,
            "ros_distro": os.environ.get("ROS_DISTRO", DISTRO),
        }


def _topic_metadata(topic: _Topic) -> dict[str, Any]:
    metadata = {
        "name": topic.name,
        "type": topic.kind.name,
        "serialization_format": "cdr",
        "offered_qos_profiles": [qos_to_profile(offer) for offer in topic.offers],
        "type_description_hash": topic.kind.hash,
    }
    return {"topic_metadata": metadata, "message_count": topic.count}


def _definition(kind: InterfaceType) -> str:
    """Return the text of a message definition; empty if the type is unknown or of another version."""
    try:
        message = message_type(kind.name)
    except KeyError:
        return ""
    return definition_text(message) if InterfaceType.of(message) == kind else ""


def _yaml(plain: dict[str, Any]) -> str:
    return yaml.safe_dump(plain, sort_keys=False)
