"""Bags of ROS 1, and those that rosbag2 wrote to SQLite, by the library rosbags."""

from __future__ import annotations

import os
import sqlite3
import struct
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from chefbot.ros2.bag.errors import BagError
from chefbot.ros2.bag.reader import BagMessage, BagTopic
from chefbot.ros2.bag.writer import METADATA_FILE
from chefbot.ros2.rmw.names import InterfaceType

ROS1, SQLITE = ".bag", ".db3"
ENCODING = "cdr"
RENAMED = {"tf/msg/tfMessage": "tf2_msgs/msg/TFMessage"}
"""Types of ROS 1 that have another name, and the same fields, in ROS 2."""


def needs_rosbags(path: Path) -> bool:
    """Return whether a path is a bag of ROS 1 or a bag that is stored in SQLite."""
    return path.suffix in (ROS1, SQLITE) or (os.path.isdir(path) and any(path.glob(f"*{SQLITE}")))  # noqa: PTH112


class RosbagsBag:
    """A bag that the library rosbags reads; its messages are given as CDR, those of ROS 1 converted."""

    def __init__(self, path: Path) -> None:
        """Read the topics. Raises BagError without the library, or if the bag cannot be read."""
        if not os.path.exists(path):  # noqa: PTH110 - Path's method raises for names that no file can have
            raise BagError(f"bag {path} does not exist; check the name")
        self._path = path.parent if path.suffix == SQLITE else path
        if self._path.is_dir() and not (self._path / METADATA_FILE).is_file():
            raise BagError(f"{self._path} has no {METADATA_FILE}; `ros2 bag reindex` makes one")
        with self._opened() as (reader, _):
            self.topics = tuple(
                BagTopic(one.topic, InterfaceType(_type_name(one), ""), ENCODING, (), one.msgcount)
                for one in reader.connections
            )

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Iterate over the messages of some topics in time order."""
        with self._opened() as (reader, types):
            chosen = [one for one in reader.connections if one.topic in topics]
            for connection, time_ns, raw in reader.messages(chosen):
                kind = InterfaceType(_type_name(connection), "")
                data = raw if reader.is2 else types.ros1_to_cdr(raw, kind.name)
                yield BagMessage(connection.topic, kind, bytes(data), time_ns, time_ns)

    @contextmanager
    def _opened(self) -> Iterator[tuple[Any, Any]]:
        """Yield the reader, and the types of ROS 2, in which a header has no sequence number."""
        try:
            from rosbags.highlevel import AnyReader, AnyReaderError
            from rosbags.serde import SerdeError
            from rosbags.typesys import Stores, get_typestore
        except ImportError:
            raise BagError(
                f"{self._path} is a bag of ROS 1 or in SQLite, which needs pip install 'chefbot[rosbags]'"
            ) from None
        try:
            types = get_typestore(Stores.ROS2_HUMBLE)
            with AnyReader([self._path], default_typestore=types) as reader:
                yield reader, types
        except (
            AnyReaderError,
            SerdeError,
            sqlite3.Error,
            OSError,
            struct.error,
            ValueError,
            KeyError,
            IndexError,
        ) as error:
            raise BagError(f"bag {self._path} cannot be read: {_cause(error, self._path)}") from None


def _cause(error: Exception, path: Path) -> str:
    """Return in words why the library cannot read a bag."""
    text = str(error)
    if path.is_dir():
        return "it is cut off, damaged, or no bag of rosbag2"
    if "index" in text.lower():
        return "it is cut off or damaged; `rosbag reindex` may repair it"
    return "it is damaged, or no bag of ROS 1"


def _type_name(connection: Any) -> str:
    return RENAMED.get(connection.msgtype, connection.msgtype)
