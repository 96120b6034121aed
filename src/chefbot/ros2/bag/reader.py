"""A tolerant bag reader for folders and files of rosbag2 and other recorders, complete or truncated."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from mcap.records import Channel, Message, Schema

from chefbot.config import ConfigError, open_file, parse_yaml, read_bytes
from chefbot.msgs.idl.registry import message_type
from chefbot.ros2.bag.errors import BagError
from chefbot.ros2.bag.qos_profile import parse_qos_profiles
from chefbot.ros2.bag.writer import METADATA_FILE, METADATA_RECORD
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import QoS
from chefbot.storage.mcap_reading import READ_ERRORS, limited, mcap_reader, mcap_records, reason

MAX_METADATA = 50_000_000


class BagMessage(NamedTuple):
    """A recorded message as CDR bytes, with its receive and publish times in ns."""

    topic: str
    kind: InterfaceType
    data: bytes
    log_time_ns: int
    publish_time_ns: int


class BagTopic(NamedTuple):
    """A topic of a bag with one message type."""

    name: str
    kind: InterfaceType
    """Message type; its hash is '' where it is known neither from the bag nor here."""
    encoding: str
    offered_qos: tuple[QoS, ...]
    messages: int


class Bag(NamedTuple):
    """The contents of a bag; messages are read on demand."""

    path: Path
    files: tuple[Path, ...]
    topics: tuple[BagTopic, ...]
    start_ns: int
    end_ns: int
    truncated: tuple[str, ...]
    """A sentence for each truncated file; messages before the truncation are included."""
    distro: str
    truncated_files: frozenset[Path]
    """Files that end in the middle of a record or are damaged: they have no index."""

    @property
    def total(self) -> int:
        """Number of messages on all topics."""
        return sum(topic.messages for topic in self.topics)

    @property
    def size(self) -> int:
        """Size of all files, bytes."""
        return sum(file.stat().st_size for file in self.files)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[BagMessage]:
        """Iterate over the messages in time order, optionally of some topics only.

        Truncated files are read up to the truncation, in file order.
        """
        for file in self.files:
            yield from _messages(file, topics, cut=file in self.truncated_files)


def read_bag(path: Path) -> Bag:
    """Read a bag folder or an MCAP file.

    Raises BagError when it is neither, or nothing in it can be read.
    """
    folder = os.path.isdir(path)  # noqa: PTH112 - Path's method raises for names that no file can have
    metadata = _read_metadata(path) if folder else {}
    files = _files_of(path, metadata) if folder else [path]
    contents = [_read_contents(file) for file in files]
    cut = tuple(content.cut for content in contents if content.cut)
    cut_files = frozenset(file for file, content in zip(files, contents, strict=True) if content.cut)
    if folder and not metadata and not cut:
        cut = (
            f"{path} has no {METADATA_FILE}: recording ended too early; all {len(files)} files are complete",
        )
    starts = [content.start_ns for content in contents if content.topics and content.start_ns]
    ends = [content.end_ns for content in contents]
    distro = str(
        metadata.get("ros_distro") or next((content.distro for content in contents if content.distro), "")
    )
    start, end = min(starts, default=0), max(ends, default=0)
    return Bag(path, tuple(files), _merge(contents), start, end, cut, distro, cut_files)


class _Contents(NamedTuple):
    """Topics and times of one file."""

    topics: list[BagTopic]
    start_ns: int
    end_ns: int
    cut: str = ""
    distro: str = ""


def _read_metadata(folder: Path) -> dict[str, Any]:
    file = folder / METADATA_FILE
    if not file.is_file():
        return {}
    data = read_bytes(file, "bag metadata", MAX_METADATA)
    try:
        metadata = parse_yaml(data, str(file))["rosbag2_bagfile_information"]
        storage = metadata["storage_identifier"]
    except (ConfigError, KeyError, TypeError):
        raise BagError(
            f"{file} is not bag metadata; remove it, and the MCAP files beside it are read"
        ) from None
    if storage != "mcap":
        raise BagError(
            f"{folder} is stored as {storage}; only mcap is supported, convert it with `ros2 bag convert`"
        )
    if metadata.get("compression_mode"):
        raise BagError(f"{folder} is compressed by rosbag2 itself; `ros2 bag convert` unpacks it")
    return dict(metadata)


def _files_of(folder: Path, metadata: dict[str, Any]) -> list[Path]:
    names = metadata.get("relative_file_paths") or []
    if not isinstance(names, list):
        raise BagError(f"{folder / METADATA_FILE}: relative_file_paths must be a list of names")
    listed = [folder / str(name) for name in names]
    files = listed or sorted(folder.glob("*.mcap"))
    if not files:
        raise BagError(f"{folder} contains no bag: no {METADATA_FILE} and no MCAP file")
    return files


def _read_contents(file: Path) -> _Contents:
    try:
        # Without a summary index the file is scanned record by record
        with open_file(file) as stream:
            return _summary(stream) or _scan(file, stream)
    except FileNotFoundError:
        raise BagError(f"bag {file} does not exist; check the name") from None
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise BagError(f"bag {file} cannot be read: {cause}") from None


def _summary(stream: BinaryIO) -> _Contents | None:
    """Read the summary index at the end of a file; None if there is none."""
    try:
        reader = mcap_reader(stream)
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            return None
        counts = summary.statistics.channel_message_counts
        topics = [
            _topic(summary.schemas, channel, counts.get(channel.id, 0))
            for channel in summary.channels.values()
        ]
        distro = next(
            (_distro(record.metadata) for record in reader.iter_metadata() if record.name == METADATA_RECORD),
            "",
        )
    except (
        *READ_ERRORS,
        OSError,
        TypeError,
    ):  # seeks before the start of a short file; _scan reports the error
        return None
    statistics = summary.statistics
    return _Contents(topics, statistics.message_start_time, statistics.message_end_time, distro=distro)


def _distro(metadata: dict[str, str]) -> str:
    try:
        return str(
            parse_yaml(metadata.get("serialized_metadata", "").encode(), "metadata").get("ros_distro", "")
        )
    except (ConfigError, AttributeError):
        return ""


def _scan(file: Path, stream: BinaryIO) -> _Contents:
    """Read a file record by record up to its end or truncation."""
    stream.seek(0)
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    counts: dict[int, int] = {}
    times: list[int] = []
    cause = ""
    try:
        for message in limited(_scanned_messages(stream, schemas, channels), stream):
            counts[message.channel_id] = counts.get(message.channel_id, 0) + 1
            times = [min([message.log_time, *times[:1]]), max([message.log_time, *times[1:]])]
    except READ_ERRORS as error:
        cause = reason(error)
    if cause and not channels:
        raise BagError(f"{file} is not an MCAP file, or cut off before its first message: {cause}")
    topics = [_topic(schemas, channel, counts.get(channel.id, 0)) for channel in channels.values()]
    total = sum(counts.values())
    cut = f"{file} was cut off or is damaged; the {total} messages before are intact" if cause else ""
    first, last = times or [0, 0]
    return _Contents(topics, first, last, cut)


def _topic(schemas: dict[int, Schema], channel: Channel, count: int) -> BagTopic:
    offers = tuple(parse_qos_profiles(channel.metadata.get("offered_qos_profiles", "")))
    return BagTopic(
        channel.topic,
        _type_of(schemas.get(channel.schema_id), channel),
        channel.message_encoding,
        offers,
        count,
    )


def _type_of(schema: Schema | None, channel: Channel) -> InterfaceType:
    """Return the type with the recorded hash, else with that of our own type of the same name."""
    name = schema.name if schema else ""
    if name.count("/") == 1:
        name = name.replace("/", "/msg/")
    recorded_hash = channel.metadata.get("topic_type_hash", "")
    if recorded_hash:
        return InterfaceType(name, recorded_hash)
    try:
        return InterfaceType.of(message_type(name))
    except KeyError:
        return InterfaceType(name, "")


def _merge(contents: list[_Contents]) -> tuple[BagTopic, ...]:
    """Merge the topics of all files and channels to one entry per topic and type."""
    merged: dict[tuple[str, InterfaceType], BagTopic] = {}
    for topic in (topic for content in contents for topic in content.topics):
        key = topic.name, topic.kind
        existing = merged.get(key)
        if existing is None:
            merged[key] = topic
        else:
            offers = tuple(dict.fromkeys((*existing.offered_qos, *topic.offered_qos)))
            merged[key] = existing._replace(offered_qos=offers, messages=existing.messages + topic.messages)
    return tuple(merged[key] for key in sorted(merged))


def _messages(file: Path, topics: Collection[str] | None, *, cut: bool) -> Iterator[BagMessage]:
    count = 0
    try:
        with open_file(file) as stream:
            for schema, channel, message in _records(stream, cut):
                if topics is None or channel.topic in topics:
                    kind = _type_of(schema, channel)
                    yield BagMessage(
                        channel.topic, kind, message.data, message.log_time, message.publish_time
                    )
                    count += 1
    except READ_ERRORS as error:
        if not cut:
            raise BagError(f"{file} is damaged after {count} messages: {reason(error)}") from None


def _records(stream: BinaryIO, cut: bool) -> Iterator[tuple[Schema | None, Channel, Message]]:
    if not cut:
        yield from limited(mcap_reader(stream).iter_messages(), stream)
        return
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    for message in limited(_scanned_messages(stream, schemas, channels), stream):
        channel = channels[message.channel_id]
        yield schemas.get(channel.schema_id), channel, message


def _scanned_messages(
    stream: BinaryIO, schemas: dict[int, Schema], channels: dict[int, Channel]
) -> Iterator[Message]:
    """Iterate over the messages in file order, adding the schemas and channels on the way."""
    for record in mcap_records(stream):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message):
            yield record
