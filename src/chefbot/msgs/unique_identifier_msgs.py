"""unique_identifier_msgs: unique IDs, such as those of goals."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.idl.message import Message

_NIL = np.zeros(16, np.uint8)


class UUID(Message, frozen=True, eq=False):
    """A universally unique identifier of 16 bytes."""

    uuid: Annotated[NDArray[np.uint8], "uint8[16]"] = _NIL

    @property
    def key(self) -> bytes:
        """The UUID as bytes, usable as a dictionary key."""
        return self.uuid.tobytes()
