"""uvicorn's protocols with two limits more: idle or too many connections, and peers that never read."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

MAX_CONNECTIONS = 64
HEADER_LIMIT = 5.0
"""Seconds in which a new connection must have sent its first request (against slow-loris)."""
LINGER = 0.2
"""Seconds between the polite end of a socket and its abrupt one."""


class GuardedHttp(H11Protocol):
    """Refuses connections beyond the limit, and ends those that say nothing."""

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Take the connection, or cut it off."""
        super().connection_made(transport)
        if len(self.connections) > MAX_CONNECTIONS:
            transport.abort()
            return
        asyncio.get_running_loop().call_later(HEADER_LIMIT, self._end_if_silent)

    def _end_if_silent(self) -> None:
        upgraded = self.transport.get_protocol() is not self
        if self.cycle is None and not upgraded:
            self.transport.abort()


class GuardedSocket(WebSocketsSansIOProtocol):
    """Cuts the connection when its handler has ended, even if the peer does not read its last bytes."""

    async def run_asgi(self, *args: Any) -> None:
        """Run the handler, then end the connection."""
        await super().run_asgi(*args)
        asyncio.get_running_loop().call_later(LINGER, self.transport.abort)
