"""In the place of a driver that does not exist yet."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.errors import UserError
from chefbot.runtime.node import Device


class NotWrittenParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is missing."""

    sentence: Annotated[str, Meta(min_length=1, description="what is missing and what to do instead")]


class NotWrittenDevice(Device):
    """Refuses to start, and says why: a launch that would do nothing must not look as if it worked."""

    params: NotWrittenParams

    def start(self) -> None:
        """Refuse."""
        raise UserError(self.params.sentence)
