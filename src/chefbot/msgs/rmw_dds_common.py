"""rmw_dds_common: how ROS 2 tells over DDS which node has which readers and writers."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.idl.message import Message

_NOBODY = np.zeros(16, np.uint8)
Name = Annotated[str, "string<=256"]


class Gid(Message, frozen=True, eq=False):
    """16 bytes that tell one DDS entity from all others; Humble has 24."""

    data: Annotated[NDArray[np.uint8], "uint8[16]"] = _NOBODY


class NodeEntitiesInfo(Message, frozen=True, eq=False):
    """A node, and what it reads and writes."""

    node_namespace: Name = "/"
    node_name: Name = ""
    reader_gid_seq: tuple[Gid, ...] = ()
    writer_gid_seq: tuple[Gid, ...] = ()


class ParticipantEntitiesInfo(Message, frozen=True, eq=False):
    """All nodes of one DDS participant."""

    gid: Gid = Gid()
    node_entities_info_seq: tuple[NodeEntitiesInfo, ...] = ()
