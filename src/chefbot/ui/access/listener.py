"""uvicorn's server with an accept loop of its own: addresses are limited before anything is read, TLS included."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import struct
import time
from collections.abc import Callable
from typing import Any

import uvicorn

from chefbot.ui.access.address_limits import AddressLimits

ACCEPTS_PER_TURN = 8
"""Maximum number of connections that are accepted before the event loop serves others."""
STRANGER_TIMEOUT = 5.0
"""Time from the connection to its first valid request, TLS handshake included, s (against slow-loris)."""
RETRY_DELAY = 0.5
"""Delay before connections are accepted again after the system had no descriptor for one, s."""
LOG_BURST, LOG_PERIOD = 5, 60.0
"""Number of uvicorn's log records that pass at once, and period of further ones, s."""
RECEIVE_BUFFER = 8192
"""Receive buffer of a connection in the kernel, bytes: what one client can make the event loop process at once."""
_RESET = struct.pack("ii", 1, 0)
"""Option of SO_LINGER: a refused connection is reset and leaves nothing behind."""


def abort(transport: asyncio.Transport) -> None:
    """End a connection at once.

    A TLS transport that was closed twice has no protocol any more: Python 3.11.2 (Debian 12) then raises in `abort`;
    the shutdown, which has a timeout, is under way. Later versions look for the protocol themselves.
    """
    if getattr(transport, "_ssl_protocol", transport) is not None:
        transport.abort()


class LogLimit(logging.Filter):
    """Passes LOG_BURST records, and then one in each LOG_PERIOD: unknown peers must not fill the disk."""

    def __init__(self) -> None:
        super().__init__()
        self._allowed, self._updated = float(LOG_BURST), time.monotonic()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the record may be logged."""
        del record
        now = time.monotonic()
        self._allowed = min(float(LOG_BURST), self._allowed + (now - self._updated) / LOG_PERIOD)
        self._updated = now
        if self._allowed < 1.0:
            return False
        self._allowed -= 1.0
        return True


class Peer:
    """The other end of one connection, from its acceptance on."""

    def __init__(self, raw: socket.socket, host: str, limits: AddressLimits[Peer]) -> None:
        self.host = host
        self.transport: asyncio.Transport | None = None
        """The connection's transport; None before the end of the TLS handshake."""
        self._raw = raw
        self._limits = limits
        loop = asyncio.get_running_loop()
        self._timer = loop.call_later(STRANGER_TIMEOUT, self._on_timeout)

    def recognize(self) -> None:
        """Count the connection as a visitor's, after a valid request."""
        self._timer.cancel()
        _end(self._limits.recognize(self, asyncio.get_running_loop().time()))

    def leave(self) -> None:
        """Take the connection out of the limits: it has ended, or a valid web socket has begun."""
        self._timer.cancel()
        self._limits.remove(self)

    def end(self) -> None:
        """End the connection at once."""
        self.leave()
        if self.transport is not None:
            abort(self.transport)
        else:
            with contextlib.suppress(OSError):  # it has ended meanwhile
                self._raw.shutdown(socket.SHUT_RDWR)

    def _on_timeout(self) -> None:
        if self._limits.is_stranger(self):
            self.end()


class GuardedServer(uvicorn.Server):
    """Accepts connections within the limits; each protocol object and each request knows its `Peer`.

    Requests find it in the ASGI scope's `state` under "peer". uvicorn's own way to listen accepts everything that
    waits at once, and knows of a TLS connection only after its handshake.
    """

    limits: AddressLimits[Peer]

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.limits = AddressLimits()
        logger = logging.getLogger("uvicorn.error")
        if not any(isinstance(limit, LogLimit) for limit in logger.filters):
            logger.addFilter(LogLimit())

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to accept connections at the listening sockets."""
        self.servers = [_Acceptor(listener, self) for listener in sockets or []]
        self.started = True

    def protocol_of(self, peer: Peer) -> asyncio.Protocol:
        """Return a new protocol object for a connection."""
        kind: Callable[..., asyncio.Protocol] = self.config.http_protocol_class
        return kind(config=self.config, server_state=self.server_state, app_state={"peer": peer})


class _Acceptor:
    """Accepts the connections of one listening socket; the interface is that of asyncio's servers."""

    def __init__(self, listener: socket.socket, server: GuardedServer) -> None:
        self._listener, self._server = listener, server
        self._loop = asyncio.get_running_loop()
        self._handshakes: set[asyncio.Task[None]] = set()
        listener.setblocking(False)
        listener.setsockopt(
            socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER
        )  # accepted sockets inherit it
        self._start()

    def _start(self) -> None:
        if self._listener.fileno() >= 0:
            self._loop.add_reader(self._listener.fileno(), self._accept)

    def close(self) -> None:
        """Stop accepting connections and cancel handshakes in progress."""
        self._loop.remove_reader(self._listener.fileno())
        for handshake in self._handshakes:
            handshake.cancel()

    async def wait_closed(self) -> None:
        """Wait until no handshake is in progress."""
        await asyncio.gather(*self._handshakes, return_exceptions=True)

    def _accept(self) -> None:
        for _ in range(ACCEPTS_PER_TURN):
            try:
                raw, address = self._listener.accept()
            except (BlockingIOError, ConnectionAbortedError):  # none waits, or it has ended already
                return
            except OSError:  # no descriptor is free: the socket stays readable, so try again later
                self._loop.remove_reader(self._listener.fileno())
                self._loop.call_later(RETRY_DELAY, self._start)
                return
            self._take(raw, str(address[0]))

    def _take(self, raw: socket.socket, host: str) -> None:
        limits, now = self._server.limits, self._loop.time()
        if not limits.may_connect(host, now):
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
            raw.close()
            return
        raw.setblocking(False)
        peer = Peer(raw, host, limits)
        _end(limits.add(peer, host, now))
        handshake = self._loop.create_task(self._connect(raw, peer))
        self._handshakes.add(handshake)
        handshake.add_done_callback(self._handshakes.discard)

    async def _connect(self, raw: socket.socket, peer: Peer) -> None:
        tls = self._server.config.ssl
        timeouts: dict[str, float] = {}
        if tls:
            timeouts = {"ssl_handshake_timeout": STRANGER_TIMEOUT, "ssl_shutdown_timeout": STRANGER_TIMEOUT}
        try:
            await self._loop.connect_accepted_socket(
                lambda: self._server.protocol_of(peer), raw, ssl=tls, **timeouts
            )
        except OSError:  # the handshake failed or took too long
            peer.leave()
            raw.close()


def _end(peers: list[Any]) -> None:
    for peer in peers:
        peer.end()
