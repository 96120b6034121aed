"""rmw_dds_common: the discovery message that maps nodes to DDS readers and writers."""

from __future__ import annotations

from typing import Annotated

from chefbot.msgs.idl.message import NIL, Message, Uint8Array16

Name = Annotated[str, "string<=256"]


class Gid(Message, frozen=True, eq=False):
    """The 16-byte global identifier of a DDS entity (24 bytes in Humble)."""

    data: Uint8Array16 = NIL


class NodeEntitiesInfo(Message, frozen=True, eq=False):
    """A node with the GIDs of its readers and writers."""

    node_namespace: Name = "/"
    node_name: Name = ""
    reader_gid_seq: tuple[Gid, ...] = ()
    writer_gid_seq: tuple[Gid, ...] = ()


class ParticipantEntitiesInfo(Message, frozen=True, eq=False):
    """All nodes of a DDS participant."""

    gid: Gid = Gid()
    node_entities_info_seq: tuple[NodeEntitiesInfo, ...] = ()
