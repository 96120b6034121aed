"""Liveliness tokens: how nodes and their ends make themselves known, and the GID that follows from each."""

from __future__ import annotations

from typing import NamedTuple

import xxhash

from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.names import WireType, ros_name
from chefbot.ros2.rmw.qos import QoS, parse_qos

ROOT = "@ros2_lv"
NODE, PUBLISHER, SUBSCRIPTION, SERVER, CLIENT = "NN", "MP", "MS", "SS", "SC"
_ENDS = (PUBLISHER, SUBSCRIPTION, SERVER, CLIENT)
_NODE_FIELDS, _END_FIELDS = 9, 13


class NodeId(NamedTuple):
    """A node, and in which session it lives."""

    domain: int
    zid: str
    """The session's id as Zenoh writes it; opaque."""
    nid: str
    """Counted within the session."""
    namespace: str
    """'/' or '/robot1'"""
    name: str
    enclave: str = "/"

    @property
    def full_name(self) -> str:
        """'/robot1/base'"""
        return f"{self.namespace.rstrip('/')}/{self.name}"


class End(NamedTuple):
    """What a node does on one topic or service."""

    id: str
    kind: str
    """MP publisher, MS subscription, SS service server, SC service client."""
    topic: str
    """'/robot1/scan'"""
    type: WireType
    qos: QoS
    backends: str = ""
    """Of newer rmw_zenoh: 'backends:cpu:' and the like."""


class Token(NamedTuple):
    """One token: of a node, or of one of its ends."""

    node: NodeId
    end: End | None = None

    def __str__(self) -> str:
        """The key expression."""
        node, end = self.node, self.end
        head = f"{ROOT}/{node.domain}/{node.zid}/{node.nid}/{end.id if end else node.nid}"
        about = f"{_mangle(node.enclave)}/{_mangle(node.namespace)}/{node.name}"
        if end is None:
            return f"{head}/{NODE}/{about}"
        tail = f"{_mangle(end.topic)}/{end.type.dds}/{end.type.hash}/{end.qos}"
        return f"{head}/{end.kind}/{about}/{tail}" + (f"/{end.backends}" if end.backends else "")

    @property
    def gid(self) -> bytes:
        """16 bytes that tell this end from all others: XXH3-128 of the token, low half first."""
        return gid_of(str(self))


def gid_of(token: str) -> bytes:
    """The GID of a token's text."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")


def all_tokens(domain: int) -> str:
    """The key expression of every token of a domain."""
    return f"{ROOT}/{domain}/**"


def parse_token(text: str) -> Token:
    """The token. WireError when it is none, e.g. with an empty field; more fields than known are allowed."""
    fields = text.split("/")
    if fields[0] != ROOT:
        raise WireError(f"{text!r} is no token: it does not begin with {ROOT}")
    if len(fields) < _NODE_FIELDS or not all(fields[:_END_FIELDS]):
        raise WireError(f"{text!r} is no token: a field is missing or empty")
    _, domain, zid, nid, own, kind, enclave, namespace, name = fields[:_NODE_FIELDS]
    if not (domain.isascii() and domain.isdigit() and len(domain) <= 4):
        raise WireError(f"{text!r} is no token: {domain!r} is no domain")
    node = NodeId(int(domain), zid, nid, _demangle(namespace), name, _demangle(enclave))
    if kind == NODE:
        return Token(node)
    if kind not in _ENDS:
        raise WireError(f"{text!r} is no token: {kind!r} is no kind of end")
    if len(fields) < _END_FIELDS:
        raise WireError(f"{text!r} is no token: an end has {_END_FIELDS} fields, not {len(fields)}")
    topic, dds, type_hash, qos = fields[_NODE_FIELDS:_END_FIELDS]
    backends = "/".join(fields[_END_FIELDS:])
    return Token(
        node, End(own, kind, _demangle(topic), WireType(ros_name(dds), type_hash), parse_qos(qos), backends)
    )


def _mangle(name: str) -> str:
    return name.replace("/", "%")


def _demangle(name: str) -> str:
    return name.replace("%", "/")
