"""One browser: what it has yet to be sent, and how often it may speak."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Collection, Iterable, Mapping

from starlette.websockets import WebSocket, WebSocketDisconnect

from chefbot.ui import wire

SEND_LIMIT = 3.0
"""Seconds that one frame may take; a browser slower than that is dropped."""
COMMANDS_PER_SECOND = 30.0
BURST = 60.0


class Client:
    """Holds the names of layers that changed since they were sent, so its memory never grows with time."""

    def __init__(self, socket: WebSocket, *, only_stop: bool = False) -> None:
        self.socket = socket
        self.only_stop = only_stop
        """Whether it came when there were too many."""
        self.dismissed = asyncio.Event()
        self._dirty: dict[str, None] = {}
        self._answers: deque[str] = deque(maxlen=8)
        self._pong = ""
        self._wake = asyncio.Event()
        self._credit = BURST
        self._heard = asyncio.get_running_loop().time()
        self.greeted = False

    def offer(self, layers: Iterable[str], few: Collection[str]) -> None:
        """These layers have a new frame; who may only press STOP gets the `few`."""
        self._dirty.update((layer, None) for layer in layers if not self.only_stop or layer in few)
        self._wake.set()

    def answer(self, sentence: str) -> None:
        """Tell this browser why its command was refused; the oldest of many unsent sentences are dropped."""
        self._answers.append(wire.refused(sentence))
        self._wake.set()

    def pong(self, number: int) -> None:
        """Answer a ping."""
        self._pong = wire.pong(number)
        self._wake.set()

    def may_speak(self) -> bool:
        """Count a message against the rate that is allowed (token bucket)."""
        now = asyncio.get_running_loop().time()
        self._credit = min(BURST, self._credit + (now - self._heard) * COMMANDS_PER_SECOND) - 1
        self._heard = now
        return self._credit >= 0

    async def send_forever(self, frames: Mapping[str, wire.Frame]) -> None:
        """Send each changed layer's newest frame; returns when the browser is gone or too slow."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._pong or self._answers or self._dirty:
                frame = self._next(frames)
                try:
                    await asyncio.wait_for(self._send(frame), SEND_LIMIT)
                except (TimeoutError, WebSocketDisconnect):
                    return

    def _next(self, frames: Mapping[str, wire.Frame]) -> wire.Frame:
        """Whether the connection is alive comes first, then answers, then STOP."""
        pong, self._pong = self._pong, ""
        return pong or (self._answers.popleft() if self._answers else frames[self._oldest()])

    def _oldest(self) -> str:
        layer = "stop" if "stop" in self._dirty else next(iter(self._dirty))
        del self._dirty[layer]
        return layer

    async def _send(self, frame: wire.Frame) -> None:
        if isinstance(frame, str):
            await self.socket.send_text(frame)
        else:
            await self.socket.send_bytes(frame)
