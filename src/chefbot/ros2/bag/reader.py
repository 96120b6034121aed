"""Bags as they are found: folders and files, whole or cut off, of rosbag2, chefbot and other recorders."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

import yaml
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from zstandard import ZstdError

from chefbot.errors import UserError
from chefbot.msgs.idl.registry import message_type
from chefbot.ros2.bag.profile import read_profiles
from chefbot.ros2.bag.writer import METADATA_FILE, METADATA_RECORD
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.qos import QoS

DAMAGE = (
    McapError, ZstdError, struct.error, ValueError, EOFError, KeyError, IndexError, MemoryError, OverflowError,
)  # fmt: skip
"""What the library raises where a file ends too early or holds something else."""
MAX_METADATA = 50_000_000


class BagMessage(NamedTuple):
    """One message, as bytes."""

    topic: str
    kind: WireType
    data: bytes
    heard_ns: int
    said_ns: int


class BagTopic(NamedTuple):
    """What a bag has of one topic and type."""

    name: str
    kind: WireType
    """The hash is '' where neither the bag nor we know it."""
    encoding: str
    offers: tuple[QoS, ...]
    messages: int


class Bag(NamedTuple):
    """What is in it; its messages are read when asked for."""

    path: Path
    files: tuple[Path, ...]
    topics: tuple[BagTopic, ...]
    start_ns: int
    end_ns: int
    cut: tuple[str, ...]
    """A sentence for each file that ends too early; what is before the cut is here."""
    distro: str

    @property
    def total(self) -> int:
        """All messages."""
        return sum(topic.messages for topic in self.topics)

    @property
    def size(self) -> int:
        """Bytes on the disk."""
        return sum(file.stat().st_size for file in self.files)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[BagMessage]:
        """In the order of time; of a file that is cut off, up to there, in the order of the file."""
        for file in self.files:
            yield from _messages(file, topics, cut=any(str(file) in sentence for sentence in self.cut))


def read_bag(path: Path) -> Bag:
    """Folder or MCAP file. UserError when it is neither, or nothing in it can be read."""
    folder = path.is_dir()
    about = _read_metadata(path) if folder else {}
    files = _files_of(path, about) if folder else [path]
    found = [_look(file) for file in files]
    cut = tuple(one.cut for one in found if one.cut)
    if folder and not about and not cut:
        cut = (f"{path} has no {METADATA_FILE}: recording ended too early; all {len(files)} files are whole",)
    starts = [one.start_ns for one in found if one.topics and one.start_ns]
    ends = [one.end_ns for one in found]
    distro = str(about.get("ros_distro") or next((one.distro for one in found if one.distro), ""))
    start, end = min(starts, default=0), max(ends, default=0)
    return Bag(path, tuple(files), _merge(found), start, end, cut, distro)


class _Contents(NamedTuple):
    """Of one file."""

    topics: list[BagTopic]
    start_ns: int
    end_ns: int
    cut: str = ""
    distro: str = ""


def _read_metadata(folder: Path) -> dict[str, Any]:
    file = folder / METADATA_FILE
    if not file.is_file():
        return {}
    try:
        with file.open(encoding="utf-8") as text:
            about = yaml.safe_load(text.read(MAX_METADATA))["rosbag2_bagfile_information"]
            storage = about["storage_identifier"]
    except OSError as error:
        raise UserError(f"{file} cannot be read: {error.strerror}") from None
    except (yaml.YAMLError, KeyError, TypeError, ValueError):
        raise UserError(
            f"{file} is no metadata of a bag; remove it, and the MCAP files beside it are read"
        ) from None
    if storage != "mcap":
        raise UserError(
            f"{folder} is stored as {storage}, only mcap is read; `ros2 bag convert` makes one of it"
        )
    if about.get("compression_mode"):
        raise UserError(f"{folder} is compressed by rosbag2 itself; `ros2 bag convert` unpacks it")
    return dict(about)


def _files_of(folder: Path, about: dict[str, Any]) -> list[Path]:
    named = [folder / str(name) for name in about.get("relative_file_paths") or []]
    files = named or sorted(folder.glob("*.mcap"))
    if not files:
        raise UserError(f"{folder} holds no bag: no {METADATA_FILE} and no MCAP file")
    return files


def _look(file: Path) -> _Contents:
    try:
        with file.open("rb") as opened:
            return _summary(opened) or _scan(file, opened)
    except FileNotFoundError:
        raise UserError(f"bag {file} does not exist; check the name") from None
    except OSError as error:
        raise UserError(f"bag {file} cannot be read: {error.strerror}") from None


def _summary(opened: IO[bytes]) -> _Contents | None:
    """From the index at the end; None where there is none."""
    try:
        reader = make_reader(opened)
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            return None
        counts = summary.statistics.channel_message_counts
        topics = [_topic(summary.schemas, one, counts.get(one.id, 0)) for one in summary.channels.values()]
        distro = next(
            (_distro(one.metadata) for one in reader.iter_metadata() if one.name == METADATA_RECORD), ""
        )
    except (*DAMAGE, OSError):  # it seeks to before the beginning of a short file; a scan tells what is wrong
        return None
    statistics = summary.statistics
    return _Contents(topics, statistics.message_start_time, statistics.message_end_time, distro=distro)


def _distro(metadata: dict[str, str]) -> str:
    try:
        return str(yaml.safe_load(metadata.get("serialized_metadata", "")).get("ros_distro", ""))
    except (yaml.YAMLError, AttributeError):
        return ""


def _scan(file: Path, opened: IO[bytes]) -> _Contents:
    """Record by record, until it breaks off."""
    opened.seek(0)
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    counts: dict[int, int] = {}
    times: list[int] = []
    reason = ""
    try:
        for record in StreamReader(opened, record_size_limit=None).records:
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                counts[record.channel_id] = counts.get(record.channel_id, 0) + 1
                times = [min([record.log_time, *times[:1]]), max([record.log_time, *times[1:]])]
    except DAMAGE as error:
        reason = str(error) or type(error).__name__
    if reason and not channels:
        raise UserError(f"{file} is no MCAP file, or cut off before its first message: {reason}")
    topics = [_topic(schemas, one, counts.get(one.id, 0)) for one in channels.values()]
    total = sum(counts.values())
    cut = f"{file} was cut off or is damaged; the {total} messages before are whole" if reason else ""
    first, last = times or [0, 0]
    return _Contents(topics, first, last, cut)


def _topic(schemas: dict[int, Schema], channel: Channel, count: int) -> BagTopic:
    offers = tuple(read_profiles(channel.metadata.get("offered_qos_profiles", "")))
    return BagTopic(
        channel.topic, _kind(schemas.get(channel.schema_id), channel), channel.message_encoding, offers, count
    )


def _kind(schema: Schema | None, channel: Channel) -> WireType:
    """The hash as recorded, else that of our own type of the name."""
    name = schema.name if schema else ""
    if name.count("/") == 1:
        name = name.replace("/", "/msg/")
    given = channel.metadata.get("topic_type_hash", "")
    if given:
        return WireType(name, given)
    try:
        return WireType.of(message_type(name))
    except KeyError:
        return WireType(name, "")


def _merge(found: list[_Contents]) -> tuple[BagTopic, ...]:
    """One for each topic and type, of all files and channels."""
    merged: dict[tuple[str, WireType], BagTopic] = {}
    for topic in (topic for one in found for topic in one.topics):
        key = topic.name, topic.kind
        known = merged.get(key)
        if known is None:
            merged[key] = topic
        else:
            offers = tuple(dict.fromkeys((*known.offers, *topic.offers)))
            merged[key] = known._replace(offers=offers, messages=known.messages + topic.messages)
    return tuple(merged[key] for key in sorted(merged))


def _messages(file: Path, topics: Collection[str] | None, *, cut: bool) -> Iterator[BagMessage]:
    count = 0
    try:
        with file.open("rb") as opened:
            for schema, channel, message in _triples(opened, cut):
                if topics is None or channel.topic in topics:
                    kind = _kind(schema, channel)
                    yield BagMessage(
                        channel.topic, kind, message.data, message.log_time, message.publish_time
                    )
                    count += 1
    except DAMAGE as error:
        if not cut:
            reason = str(error) or type(error).__name__
            raise UserError(f"{file} is damaged after {count} messages: {reason}") from None


def _triples(opened: IO[bytes], cut: bool) -> Iterator[tuple[Schema | None, Channel, Message]]:
    if not cut:
        yield from make_reader(opened).iter_messages()
        return
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    for record in StreamReader(opened, record_size_limit=None).records:
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message):
            channel = channels[record.channel_id]
            yield schemas.get(channel.schema_id), channel, record
