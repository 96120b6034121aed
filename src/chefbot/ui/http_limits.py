"""uvicorn's protocols with additional limits: slow requests, peers that never read, web sockets that do not end."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from chefbot.ui.access.listener import Peer, abort

REQUEST_TIMEOUT = 5.0
"""Maximum time from the first byte of a request to the last one of its body, s (against slow-loris)."""
STALL_TIMEOUT = 5.0
"""Time without progress after which a peer that does not read is disconnected, s."""
MIN_PROGRESS = 5_000
"""What a peer has to read in that time, bytes."""
MAX_BODY = 64_000
"""Maximum size of a request's body, bytes; no request needs one."""
LINGER = 0.2
"""Time between the closing handshake of a socket and its abort, s."""


class GuardedHttp(H11Protocol):
    """Aborts connections whose requests do not arrive, or that do not read the responses."""

    peer: Peer

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Register a new connection with its peer and start its stall check."""
        super().connection_made(transport)
        self.peer = self.app_state["peer"]
        self.peer.transport = transport
        self._request_timer: asyncio.TimerHandle | None = None
        self._stall_check = _StallCheck(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Free what belongs to the connection."""
        self._stop_timers()
        self.peer.leave()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Process received bytes; a request must be complete in time."""
        super().data_received(data)
        if self.transport.get_protocol() is not self:  # a web socket has begun, which has checks of its own
            self._stop_timers()
        elif self.cycle is not None and len(self.cycle.body) > MAX_BODY:
            abort(self.transport)
        elif self._is_incomplete():
            if self._request_timer is None:
                loop = asyncio.get_running_loop()
                self._request_timer = loop.call_later(REQUEST_TIMEOUT, abort, self.transport)
        elif self._request_timer is not None:
            self._request_timer.cancel()
            self._request_timer = None

    def _is_incomplete(self) -> bool:
        """Return whether a part of a request has been received, and a part is still missing."""
        between_requests = self.cycle is None or self.cycle.response_complete
        return bool(self.conn.trailing_data[0]) if between_requests else self.cycle.more_body

    def _stop_timers(self) -> None:
        self._stall_check.stop()
        if self._request_timer is not None:
            self._request_timer.cancel()


class GuardedSocket(WebSocketsSansIOProtocol):
    """Closes the connection when its handler has returned, even if the peer does not read its last bytes."""

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Take the connection over from HTTP."""
        super().connection_made(transport)
        self._stall_check = _StallCheck(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Free what belongs to the connection."""
        self._stall_check.stop()
        self.app_state["peer"].leave()
        super().connection_lost(exc)

    async def run_asgi(self, *args: Any) -> None:
        """Run the handler, then close the connection."""
        await super().run_asgi(*args)
        asyncio.get_running_loop().call_later(LINGER, abort, self.transport)


class _StallCheck:
    """Aborts a connection whose peer reads less than MIN_PROGRESS in STALL_TIMEOUT while data wait for it."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        self._tls = transport.get_extra_info("sslcontext") is not None
        self._waiting = 0
        self._schedule()

    def stop(self) -> None:
        """Stop checking whether the peer reads."""
        self._timer.cancel()

    def _schedule(self) -> None:
        self._timer = asyncio.get_running_loop().call_later(STALL_TIMEOUT, self._check)

    def _check(self) -> None:
        if self._tls and self._transport.is_closing():
            return  # it has no buffer to ask for any more, and its shutdown has a timeout
        waiting = self._transport.get_write_buffer_size()
        if self._waiting and waiting > self._waiting - MIN_PROGRESS:
            abort(self._transport)
            return
        self._waiting = waiting
        self._schedule()
