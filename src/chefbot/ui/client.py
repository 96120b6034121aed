"""The connection of one browser: pending frames and rate limit."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Collection, Iterable, Mapping

from starlette.websockets import WebSocket, WebSocketDisconnect

from chefbot.ui import protocol
from chefbot.ui.access.visitors import Visitor

SEND_TIMEOUT = 3.0
"""Timeout of sending one frame, s; a slower browser is disconnected."""
COMMANDS_PER_SECOND = 30.0
"""Rate limit of commands, Hz."""
BURST = 60.0
"""Capacity of the token bucket: commands that may be sent at once."""


class BrowserConnection:
    """A browser's connection. It holds only the names of layers that changed since they were sent, so its
    memory is bounded."""

    def __init__(self, socket: WebSocket, visitor: Visitor, address: str) -> None:
        self.socket = socket
        self.visitor = visitor
        self.address = address
        """IP address of the browser."""
        self.only_stop = False
        """Whether it has no full place (see `places`) and gets few layers."""
        self.disconnected = asyncio.Event()
        self._dirty: dict[str, None] = {}
        self._pending_answers: deque[str] = deque(maxlen=8)
        self._pong = ""
        self._wake = asyncio.Event()
        self._tokens = BURST
        self._last_message_time = asyncio.get_running_loop().time()
        self.initialized = False

    def mark_changed(self, layers: Iterable[str], stop_layers: Collection[str]) -> None:
        """Mark layers as changed; a client that may only stop the robot gets those in `stop_layers`."""
        self._dirty.update((layer, None) for layer in layers if not self.only_stop or layer in stop_layers)
        self._wake.set()

    def demote(self, stop_layers: Collection[str], sentence: str) -> None:
        """Take the full place away and say why; the emergency stop remains."""
        self.only_stop = True
        self._dirty = {layer: None for layer in self._dirty if layer in stop_layers}
        self.send_refusal(sentence)

    def send_refusal(self, sentence: str) -> None:
        """Send why a command was refused; the oldest of many unsent sentences are dropped."""
        self._pending_answers.append(protocol.refused(sentence))
        self._wake.set()

    def pong(self, number: int) -> None:
        """Answer a ping with its number."""
        self._pong = protocol.pong(number)
        self._wake.set()

    def within_rate_limit(self) -> bool:
        """Count a message and return whether it is within the rate limit (token bucket)."""
        now = asyncio.get_running_loop().time()
        # Token bucket: refill by elapsed time, take one token per message.
        self._tokens = min(BURST, self._tokens + (now - self._last_message_time) * COMMANDS_PER_SECOND) - 1
        self._last_message_time = now
        return self._tokens >= 0

    async def send_forever(self, frames: Mapping[str, protocol.Frame]) -> None:
        """Send the newest frame of each changed layer; return when the browser is disconnected or too slow."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._pong or self._pending_answers or self._dirty:
                frame = self._next(frames)
                try:
                    # wait_for of Python 3.11 loses a cancellation at the moment when the frame is sent
                    async with asyncio.timeout(SEND_TIMEOUT):
                        await self._send(frame)
                except (TimeoutError, WebSocketDisconnect):
                    return
                except RuntimeError:  # of uvicorn, when the closing handshake has begun meanwhile
                    return

    def _next(self, frames: Mapping[str, protocol.Frame]) -> protocol.Frame:
        """Return the next frame: first the pong, then answers, then the emergency stop, then other layers."""
        pong, self._pong = self._pong, ""
        return pong or (
            self._pending_answers.popleft() if self._pending_answers else frames[self._pop_layer()]
        )

    def _pop_layer(self) -> str:
        layer = "stop" if "stop" in self._dirty else next(iter(self._dirty))
        del self._dirty[layer]
        return layer

    async def _send(self, frame: protocol.Frame) -> None:
        if isinstance(frame, str):
            await self.socket.send_text(frame)
        else:
            await self.socket.send_bytes(frame)
