"""Tests that the handler of a client that is disconnected ends, whatever it was sending."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from chefbot.ui.access.visitors import ENGINEER
from chefbot.ui.client import BrowserConnection


class Socket:
    """A socket whose frame is sent when `sent` is set, or fails with `error`."""

    def __init__(self, error: Exception | None = None) -> None:
        self.sent = asyncio.Event()
        self.error = error

    async def send_text(self, _: str) -> None:
        await self.sent.wait()
        if self.error is not None:
            raise self.error


@pytest.mark.parametrize("steps", range(6))
def test_a_cancelled_sender_ends_at_any_moment(steps: int) -> None:
    async def ends() -> bool:
        web: Any = Socket()
        client = BrowserConnection(web, ENGINEER, "127.0.0.1")
        sender = asyncio.ensure_future(client.send_forever({}))
        client.pong(1)
        for _ in range(5):
            await asyncio.sleep(0)
        web.sent.set()
        for _ in range(steps):
            await asyncio.sleep(0)
        sender.cancel()
        await asyncio.wait({sender}, timeout=1.0)
        return sender.done()

    assert asyncio.run(ends())


def test_a_frame_after_the_closing_handshake_is_not_an_error() -> None:
    async def send() -> None:
        web: Any = Socket(RuntimeError("Unexpected ASGI message, after sending 'websocket.close'."))
        client = BrowserConnection(web, ENGINEER, "127.0.0.1")
        client.pong(1)
        web.sent.set()
        await client.send_forever({})

    asyncio.run(send())
