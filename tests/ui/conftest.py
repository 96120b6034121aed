"""Fixtures with a served web UI that records commands, and a WebSocket client in place of a browser."""

from __future__ import annotations

import json
import queue
import struct
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from tests.support.waiting import PATIENCE
from websockets.sync.client import ClientConnection, connect

from chefbot.ui.commands import OperatorCommand
from chefbot.ui.protocol import PieceAssembler
from chefbot.ui.server import WebUiServer


class Page:
    """A web UI on a free port; `commands` contains the commands of its clients."""

    def __init__(self) -> None:
        self.commands: queue.Queue[OperatorCommand] = queue.Queue()
        self.on_command: Callable[[OperatorCommand], None] = self.commands.put
        self.server = WebUiServer(0, "127.0.0.1", lambda command, _: self.on_command(command))
        self.url = self.server.start()
        self.live = self.url.replace("http", "ws") + "live"

    def next_command(self) -> OperatorCommand:
        return self.commands.get(timeout=PATIENCE)

    def browser(self, **options: Any) -> ClientConnection:
        browser: ClientConnection = connect(self.live, open_timeout=PATIENCE, max_size=None, **options)
        return browser


@pytest.fixture
def page() -> Iterator[Page]:
    served = Page()
    yield served
    served.server.stop()


def receive_frame(browser: ClientConnection) -> tuple[str, Any]:
    """Return (layer, value), (layer, (header, body)) of a binary layer, or ("refused", message)."""
    assembler, data = PieceAssembler(10**9), None
    while data is None:
        message = browser.recv(timeout=PATIENCE)
        data = message if isinstance(message, str) else assembler.add(message)
    if isinstance(data, str):
        message = json.loads(data)
        if "refused" in message:
            return "refused", message["refused"]
        return message["layer"], message["value"]
    (size,) = struct.unpack_from("<H", data)
    header = json.loads(data[2 : 2 + size])
    return header["layer"], (header, data[2 + size :])


@pytest.fixture
def receive() -> Callable[[ClientConnection], tuple[str, Any]]:
    return receive_frame
