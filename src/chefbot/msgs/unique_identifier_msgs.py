"""unique_identifier_msgs: unique IDs, such as those of goals."""

from __future__ import annotations

from chefbot.msgs.idl.message import NIL, Message, Uint8Array16


class UUID(Message, frozen=True, eq=False):
    """A universally unique identifier of 16 bytes."""

    uuid: Uint8Array16 = NIL

    @property
    def key(self) -> bytes:
        """The UUID as bytes, usable as a dictionary key."""
        return self.uuid.tobytes()
