"""Tests the blocking web socket client: one thread receives, another sends, and a third closes."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing

import pytest
from tests.support.waiting import PATIENCE, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from chefbot.ui.remote.blocking_web_socket import BlockingWebSocket


def echo(connection: ServerConnection) -> None:
    for message in connection:
        connection.send(message)


@pytest.fixture
def uri() -> Iterator[str]:
    with serve(echo, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"ws://127.0.0.1:{server.socket.getsockname()[1]}"
        server.shutdown()
        thread.join()


@pytest.fixture
def web(uri: str) -> Iterator[BlockingWebSocket]:
    with closing(BlockingWebSocket(uri, open_timeout=PATIENCE)) as client:
        yield client


def test_messages_keep_their_order_between_threads(web: BlockingWebSocket) -> None:
    sent = [str(number) for number in range(500)]
    sender = threading.Thread(target=lambda: [web.send(text) for text in sent])
    sender.start()
    assert [web.receive(PATIENCE) for _ in sent] == sent
    sender.join()


def test_a_timeout_loses_no_message(web: BlockingWebSocket) -> None:
    for number in range(20):
        with pytest.raises(TimeoutError):
            web.receive(0.001)
        web.send(str(number))
        assert web.receive(PATIENCE) == str(number)


def test_closing_ends_a_receiving_thread(web: BlockingWebSocket) -> None:
    ended = threading.Event()

    def receive() -> None:
        with pytest.raises(ConnectionClosed):
            web.receive()
        ended.set()

    receiver = threading.Thread(target=receive)
    receiver.start()
    web.close()
    assert ended.wait(PATIENCE)
    receiver.join()
    web.close()  # again
    with pytest.raises(ConnectionClosed):
        web.send("late")
    with pytest.raises(ConnectionClosed):
        web.receive()


def test_no_thread_remains(uri: str) -> None:
    def threads() -> list[str]:
        return [thread.name for thread in threading.enumerate() if thread.name == "web socket"]

    before = len(threads())
    BlockingWebSocket(uri, open_timeout=PATIENCE).close()
    with pytest.raises(OSError):
        BlockingWebSocket("ws://127.0.0.1:1", open_timeout=PATIENCE)
    wait_for(lambda: len(threads()) == before)
