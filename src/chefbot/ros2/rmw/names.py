"""Names: of topics and nodes as ROS resolves them, of types as DDS writes them, and of both as key expressions.

Key expressions are those of rmw_zenoh: `<domain>/<topic>/<dds type>/<type hash>`.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.definition import type_hash
from chefbot.msgs.idl.fields import FieldType, fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.service import Service
from chefbot.ros2.rmw.errors import WireError

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NAME = re.compile(rf"/{_TOKEN}(/{_TOKEN})*")
_NODE = re.compile(_TOKEN)
_ROS = re.compile(rf"{_TOKEN}/(msg|srv|action)/{_TOKEN}")
_DDS = re.compile(rf"({_TOKEN})::(msg|srv|action)::dds_::({_TOKEN})_")


class WireType(NamedTuple):
    """A type on the wire: its ROS name, and the hash that both ends must have."""

    name: str
    """'sensor_msgs/msg/LaserScan', 'std_srvs/srv/SetBool'"""
    hash: str
    """'RIHS01_...'"""

    @property
    def dds(self) -> str:
        """'sensor_msgs::msg::dds_::LaserScan_'"""
        if not _ROS.fullmatch(self.name):
            raise WireError(f"{self.name!r} is no ROS type name")
        package, folder, name = self.name.split("/")
        return f"{package}::{folder}::dds_::{name}_"

    @staticmethod
    def of(kind: type[Message] | Service[Any, Any] | Action[Any, Any, Any]) -> WireType:
        """Of a message class, a service or an action."""
        if isinstance(kind, Service):
            return WireType(kind.name, kind.type_hash)
        if isinstance(kind, Action):
            return WireType(kind.ros_name, kind.type_hash)
        return WireType(ros_type(kind), type_hash(kind))


def ros_name(dds: str) -> str:
    """'sensor_msgs/msg/LaserScan' of 'sensor_msgs::msg::dds_::LaserScan_'. WireError if it is none."""
    match = _DDS.fullmatch(dds)
    if match is None:
        raise WireError(f"{dds!r} is no DDS type name")
    return "/".join(match.groups())


def resolve(name: str, namespace: str = "/", node: str = "") -> str:
    """The full name of a topic or service: 'scan' in '/robot1' is '/robot1/scan', '~/x' is below the node."""
    if name.startswith("~"):
        name = f"{node}/{name[1:].lstrip('/')}".rstrip("/")
    full = name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"
    if not _NAME.fullmatch(full):
        raise WireError(f"{full!r} is no ROS name: letters, digits and _ between slashes, no digit first")
    return full


def check_node_name(name: str) -> str:
    """The name, if a node may be called so."""
    if not _NODE.fullmatch(name):
        raise WireError(f"{name!r} is no node name: letters, digits and _, no digit first")
    return name


def check_namespace(namespace: str) -> str:
    """'/' or a full name."""
    if namespace != "/" and not _NAME.fullmatch(namespace):
        raise WireError(f"{namespace!r} is no namespace: '/' or '/name'")
    return namespace


def topic_key(domain: int, name: str, kind: WireType) -> str:
    """The key expression of a topic or service; `name` is fully resolved."""
    return f"{domain}/{name.strip('/')}/{kind.dds}/{kind.hash}"


def has_byte_array(kind: type[Message]) -> bool:
    """Whether newer rmw_zenoh may send it by buffers: some field is an unbounded `uint8[]`."""
    return any(_is_byte_array(one) or _below(one) for one in fields_of(kind))


def _is_byte_array(field: FieldType) -> bool:
    return field.element == "uint8" and field.is_array and not field.fixed_size and not field.bound


def _below(field: FieldType) -> bool:
    return field.message is not None and has_byte_array(field.message)
