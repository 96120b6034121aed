"""A log of a run: read whole, or up to where it was cut off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec
from mcap.records import Channel, McapRecord, Message, Metadata, Schema

from chefbot.config import open_file
from chefbot.errors import UserError
from chefbot.robot.spec import Robot
from chefbot.runtime.recorder import METADATA
from chefbot.storage.mcap_reading import READ_ERRORS, limited, mcap_reader, mcap_records, reason


class LoggedMessage(NamedTuple):
    """One message of a log."""

    topic: str
    kind: str
    data: bytes
    time_ns: int
    publisher: str
    from_device: bool
    latched: bool


@dataclass(frozen=True)
class RecordedLog:
    """A log: robot, seed and the messages in order of publication.

    damage: why messages at its end may be missing, in words; empty for a complete log.
    """

    robot: Robot
    seed: int
    messages: list[LoggedMessage]
    damage: str = ""


def read_log(path: Path) -> RecordedLog:
    """Read a log that `Recorder` wrote; UserError if it is missing, damaged or from another program."""
    try:
        with open_file(path) as file:
            return _read(path, file)
    except OSError as error:
        raise UserError(f"log {path} cannot be read: {error.strerror}") from None
    except READ_ERRORS as error:
        raise UserError(f"log {path} is damaged or cut off, it cannot be replayed: {reason(error)}") from None


def read_intact_part(path: Path) -> RecordedLog:
    """Read a log up to where it was cut off or damaged, without the index at its end.

    Raises UserError if it is missing, from another program, or damaged before its first message.
    """
    about: Mapping[str, str] | None = None
    messages: list[LoggedMessage] = []
    damage = ""
    try:
        with open_file(path) as file:
            channels: dict[int, Channel] = {}
            schemas: dict[int, Schema] = {}
            for record in _limited_records(file):
                if isinstance(record, Metadata) and record.name == METADATA:
                    about = record.metadata
                elif isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    messages.append(_logged(schemas.get(channel.schema_id), channel, record))
    except OSError as error:
        raise UserError(f"log {path} cannot be read: {error.strerror}") from None
    except READ_ERRORS as error:
        damage = reason(error)
        if not messages:
            raise UserError(f"log {path} is damaged before its first message: {damage}") from None
    return _recorded(path, about, messages, damage)


def _limited_records(file: BinaryIO) -> Iterator[McapRecord]:
    """Yield the records of a file from its beginning, until its messages are too many for its size."""
    waiting: list[McapRecord] = []

    def messages() -> Iterator[Message]:
        for record in mcap_records(file):
            waiting.append(record)
            if isinstance(record, Message):
                yield record

    for _ in limited(messages(), file):
        yield from waiting
        waiting.clear()
    yield from waiting


def _read(path: Path, file: BinaryIO) -> RecordedLog:
    reader = mcap_reader(file, validate_crcs=True)
    about = {record.name: record.metadata for record in reader.iter_metadata()}.get(METADATA)
    messages = limited(reader.iter_messages(log_time_order=False), file) if about is not None else ()
    return _recorded(path, about, [_logged(*one) for one in messages], "")


def _recorded(
    path: Path, about: Mapping[str, str] | None, messages: list[LoggedMessage], damage: str
) -> RecordedLog:
    if about is None:
        raise UserError(
            f"log {path} was not recorded by chefbot: it does not say which robot and launch made it"
        )
    robot = msgspec.json.decode(about["robot"], type=Robot)
    return RecordedLog(robot, int(about["seed"]), messages, damage)


def _logged(schema: Schema | None, channel: Channel, message: Message) -> LoggedMessage:
    return LoggedMessage(
        channel.topic.lstrip("/"),
        schema.name if schema else "",
        message.data,
        message.log_time,
        channel.metadata.get("publisher", ""),
        channel.metadata.get("from_device") == "True",
        channel.metadata.get("latched") == "True",
    )
