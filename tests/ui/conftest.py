"""A served page with a recorder of commands, and a program that plays the browser."""

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
from chefbot.ui.server import WebUiServer


class Page:
    """A server on any free port; `heard` holds the commands that it passed on."""

    def __init__(self) -> None:
        self.heard: queue.Queue[OperatorCommand] = queue.Queue()
        self.on_command: Callable[[OperatorCommand], None] = self.heard.put
        self.server = WebUiServer(0, "127.0.0.1", lambda command: self.on_command(command))
        self.url = self.server.start()
        self.live = self.url.replace("http", "ws") + "live"

    def next_command(self) -> OperatorCommand:
        return self.heard.get(timeout=PATIENCE)

    def browser(self, **options: Any) -> ClientConnection:
        browser: ClientConnection = connect(self.live, open_timeout=PATIENCE, max_size=None, **options)
        return browser


@pytest.fixture
def page() -> Iterator[Page]:
    one = Page()
    yield one
    one.server.stop()


def receive(browser: ClientConnection) -> tuple[str, Any]:
    """(layer, value); (layer, (header, body)) of a bulk layer; ('refused', sentence)."""
    data = browser.recv(timeout=PATIENCE)
    if isinstance(data, str):
        message = json.loads(data)
        if "refused" in message:
            return "refused", message["refused"]
        return message["layer"], message["value"]
    (size,) = struct.unpack_from("<H", data)
    header = json.loads(data[2 : 2 + size])
    return header["layer"], (header, data[2 + size :])


@pytest.fixture
def hear() -> Callable[[ClientConnection], tuple[str, Any]]:
    return receive
