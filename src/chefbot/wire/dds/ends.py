"""A node on Zenoh whose ends come and go one by one."""

from __future__ import annotations

from typing import Any

import zenoh

from chefbot.wire.node import WireNode
from chefbot.wire.session import Wire
from chefbot.wire.tokens import Token


class Ends(WireNode):
    """What it publishes and hears stands for others, who are there for a while each; it never hears itself."""

    def __init__(self, wire: Wire, name: str) -> None:
        super().__init__(wire, name, remote_only=True)
        self._told: dict[int, zenoh.LivelinessToken] = {}

    def drop(self, entity: Any) -> None:
        """Take its token back, then end it."""
        token = self._told.pop(id(entity))
        self._tokens.remove(token)
        self._entities.remove(entity)
        token.undeclare()
        entity.close()

    def _keep(self, entity: Any, token: Token) -> Any:
        made = super()._keep(entity, token)
        self._told[id(made)] = self._tokens[-1]
        return made
