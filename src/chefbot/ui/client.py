"""The connection of one browser: what is sent to it, and its rate limit."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Collection, Iterable, Mapping

from starlette.websockets import WebSocket, WebSocketDisconnect

from chefbot.ui import protocol
from chefbot.ui.access.roles import hidden_layers
from chefbot.ui.access.token_bucket import TokenBucket
from chefbot.ui.access.visitors import Visitor
from chefbot.ui.outbox import Outbox

SEND_TIMEOUT = 3.0
"""Timeout of sending one frame, s; a slower browser is disconnected."""
COMMANDS_PER_SECOND = 30.0
"""Rate limit of commands, Hz."""
BURST = 60.0
"""Capacity of the token bucket: commands that may be sent at once."""


class BrowserConnection:
    """The connection of one browser, which gets what its outbox gives out."""

    def __init__(self, socket: WebSocket, visitor: Visitor, address: str, token: str = "") -> None:
        self.socket = socket
        self.visitor = visitor
        self.address = address
        """IP address of the browser."""
        self.token = token
        self.revoked = False
        """Whether the token was found to be not valid any more."""
        self.only_stop = False
        """Whether it has no full-access slot (see `client_slots`) and gets few layers."""
        self.disconnected = asyncio.Event()
        self._outbox = Outbox(hidden_layers(visitor.role))
        self._pending_answers: deque[str] = deque(maxlen=8)
        self._pong = ""
        self._wake = asyncio.Event()
        self._bucket = TokenBucket(COMMANDS_PER_SECOND, BURST, asyncio.get_running_loop().time())
        self.initialized = False
        self.page = ""
        """The page's name for itself, the same on its next connection; empty if it has none."""

    def mark_changed(self, layers: Iterable[str]) -> None:
        """Note layers whose frames have changed."""
        self._outbox.mark_changed(layers)
        self._wake.set()

    def show(self, layers: Collection[str], known: Iterable[str]) -> None:
        """Send only these layers from now on, at once those of them in `known` that it did not get before."""
        self._outbox.show(layers, known)
        self._wake.set()

    def note_received(self, count: int) -> None:
        """Note how many pieces of bulk layers have arrived; this counts as a command only if nothing is new."""
        if self._outbox.note_received(count):
            self._bucket.give_back()
            self._wake.set()

    def demote(self, sentence: str) -> None:
        """Take full access away and send the reason; the emergency stop remains."""
        self.only_stop = True
        self._outbox.show_only_stop()
        self.send_refusal(sentence)

    def send_refusal(self, sentence: str) -> None:
        """Send why a command was refused; the oldest of many unsent sentences are dropped."""
        self._pending_answers.append(protocol.refused(sentence))
        self._wake.set()

    def greet(self, server: str, last_ping: int, has_map: bool) -> None:
        """Send the first message: which server this is, what it has received from this page, the role here, and
        whether a map follows."""
        self._pending_answers.append(protocol.connected(server, last_ping, self.visitor.role, has_map))
        self._wake.set()

    def pong(self, number: int) -> None:
        """Answer a ping with its number."""
        self._pong = protocol.pong(number)
        self._wake.set()

    def within_rate_limit(self) -> bool:
        """Count a message and return whether it is within the rate limit (token bucket)."""
        return self._bucket.take(asyncio.get_running_loop().time())

    async def send_forever(self, frames: Mapping[str, protocol.Frame]) -> None:
        """Send the newest frame of each changed layer; return when the browser is disconnected or too slow."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while (frame := self._next(frames)) is not None:
                try:
                    # wait_for of Python 3.11 loses a cancellation at the moment when the frame is sent
                    async with asyncio.timeout(SEND_TIMEOUT):
                        await self._send(frame)
                except (TimeoutError, WebSocketDisconnect):
                    return
                except RuntimeError:  # of uvicorn, when the closing handshake has begun meanwhile
                    return

    def _next(self, frames: Mapping[str, protocol.Frame]) -> protocol.Frame | None:
        """Return the next frame, None if there is none: first answers, then the pong, then layers."""
        if self._pending_answers:
            return self._pending_answers.popleft()
        pong, self._pong = self._pong, ""
        return pong or self._outbox.take(frames)

    async def _send(self, frame: protocol.Frame) -> None:
        if isinstance(frame, str):
            await self.socket.send_text(frame)
        else:
            await self.socket.send_bytes(frame)
