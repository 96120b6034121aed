"""uvicorn's protocols with additional limits against idle or too many connections, and peers that never read."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

MAX_CONNECTIONS = 64
"""Maximum number of connections."""
HEADER_TIMEOUT = 5.0
"""Timeout of a new connection's first request, s (against slow-loris)."""
LINGER = 0.2
"""Time between the closing handshake of a socket and its abort, s."""


class GuardedHttp(H11Protocol):
    """Refuses connections above the limit, and closes those without a request."""

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Accept the connection, or abort it above the limit."""
        super().connection_made(transport)
        if len(self.connections) > MAX_CONNECTIONS:
            transport.abort()
            return
        asyncio.get_running_loop().call_later(HEADER_TIMEOUT, self._abort_if_idle)

    def _abort_if_idle(self) -> None:
        # A WebSocket upgrade has replaced the protocol: the connection is in use.
        upgraded = self.transport.get_protocol() is not self
        if self.cycle is None and not upgraded:
            self.transport.abort()


class GuardedSocket(WebSocketsSansIOProtocol):
    """Closes the connection when its handler has returned, even if the peer does not read its last bytes."""

    async def run_asgi(self, *args: Any) -> None:
        """Run the handler, then close the connection."""
        await super().run_asgi(*args)
        asyncio.get_running_loop().call_later(LINGER, self.transport.abort)
