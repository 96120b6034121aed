"""Names of topics, nodes and types: ROS name resolution, DDS type names, and Zenoh key expressions.

Key expressions have rmw_zenoh's form: `<domain>/<topic>/<dds type>/<type hash>`.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.definition import type_hash
from chefbot.msgs.idl.fields import MessageField, fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.idl.service import Service
from chefbot.ros2.rmw.errors import RmwError

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NAME = re.compile(rf"/{_TOKEN}(/{_TOKEN})*")
_NODE = re.compile(_TOKEN)
_ROS = re.compile(rf"{_TOKEN}/(msg|srv|action)/{_TOKEN}")
_DDS = re.compile(rf"({_TOKEN})::(msg|srv|action)::dds_::({_TOKEN})_")


class InterfaceType(NamedTuple):
    """A type as announced on the network: its ROS name and the type hash that both endpoints must share."""

    name: str
    """ROS name: 'sensor_msgs/msg/LaserScan', 'std_srvs/srv/SetBool'."""
    hash: str
    """Type hash: 'RIHS01_...'."""

    @property
    def dds(self) -> str:
        """DDS name of the type: 'sensor_msgs::msg::dds_::LaserScan_'."""
        if not _ROS.fullmatch(self.name):
            raise RmwError(f"{self.name!r} is not a ROS type name")
        package, folder, name = self.name.split("/")
        return f"{package}::{folder}::dds_::{name}_"

    @staticmethod
    def of(kind: type[Message] | Service[Any, Any] | Action[Any, Any, Any]) -> InterfaceType:
        """Return the type of a message class, a service or an action."""
        if isinstance(kind, Service):
            return InterfaceType(kind.name, kind.type_hash)
        if isinstance(kind, Action):
            return InterfaceType(kind.ros_name, kind.type_hash)
        return InterfaceType(ros_type(kind), type_hash(kind))


def ros_name(dds: str) -> str:
    """Convert a DDS type name to the ROS name; raises RmwError if it is none.

    'sensor_msgs::msg::dds_::LaserScan_' becomes 'sensor_msgs/msg/LaserScan'.
    """
    match = _DDS.fullmatch(dds)
    if match is None:
        raise RmwError(f"{dds!r} is not a DDS type name")
    return "/".join(match.groups())


def resolve(name: str, namespace: str = "/", node: str = "") -> str:
    """Resolve a topic or service name to its full name; raises RmwError for an invalid name.

    'scan' in the namespace '/robot1' becomes '/robot1/scan'; '~/x' is resolved below the node.
    """
    if name.startswith("~"):
        name = f"{node}/{name[1:].lstrip('/')}".rstrip("/")
    full = name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"
    if not _NAME.fullmatch(full):
        raise RmwError(f"{full!r} is not a ROS name: letters, digits and _ between slashes, no digit first")
    return full


def check_node_name(name: str) -> str:
    """Return the name if it is a valid node name; raises RmwError otherwise."""
    if not _NODE.fullmatch(name):
        raise RmwError(f"{name!r} is not a node name: letters, digits and _, no digit first")
    return name


def check_namespace(namespace: str) -> str:
    """Return the namespace if it is '/' or a full name; raises RmwError otherwise."""
    if namespace != "/" and not _NAME.fullmatch(namespace):
        raise RmwError(f"{namespace!r} is not a namespace: '/' or '/name'")
    return namespace


def topic_key(domain: int, name: str, kind: InterfaceType) -> str:
    """Return the key expression of a topic or service whose name is fully resolved."""
    return f"{domain}/{name.strip('/')}/{kind.dds}/{kind.hash}"


def has_byte_array(kind: type[Message]) -> bool:
    """Return whether some field of a message is an unbounded `uint8[]`.

    Newer rmw_zenoh may send such messages through its buffer backends.
    """
    return any(_is_byte_array(field) or _contains_byte_array(field) for field in fields_of(kind))


def may_have_byte_array(kind: InterfaceType) -> bool:
    """Return whether messages of this type may have an unbounded `uint8[]`, as those of an unknown type may."""
    try:
        return has_byte_array(message_type(kind.name))
    except KeyError:
        return True


def _is_byte_array(field: MessageField) -> bool:
    return field.element == "uint8" and field.is_array and not field.fixed_size and not field.bound


def _contains_byte_array(field: MessageField) -> bool:
    return field.message is not None and has_byte_array(field.message)
