"""Client side of a web socket for threads, on an event loop of its own.

OpenSSL allows only one thread at a time to use a TLS connection. A blocking client that receives in one thread and
sends in another breaks that: now and then a request is lost. Here only the event loop's thread uses the connection.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine
from typing import Any, TypeVar

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosedError

T = TypeVar("T")


class BlockingWebSocket:
    """A connected web socket; `options` are those of `websockets.asyncio.client.connect`, which see for errors.

    Each method may be called by any thread, `receive` by one at a time.
    """

    def __init__(self, uri: str, **options: Any) -> None:
        self._lock = threading.Lock()
        self._closed = False
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="web socket", daemon=True)
        self._thread.start()
        try:
            self._connection = self._run(_connect(uri, options))
        except BaseException:
            self._stop()
            raise

    def send(self, text: str) -> None:
        """Send a text message. Raises ConnectionClosed."""
        self._run(self._connection.send(text))

    def receive(self, timeout: float | None = None) -> str | bytes:
        """Return the next message. Raises TimeoutError after `timeout` seconds, and ConnectionClosed."""
        return self._run(asyncio.wait_for(self._connection.recv(), timeout))

    def close(self) -> None:
        """Close the connection; a thread that is receiving gets ConnectionClosed."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        asyncio.run_coroutine_threadsafe(self._connection.close(), self._loop).result()
        self._stop()

    def _run(self, coroutine: Coroutine[Any, Any, T]) -> T:
        """Run a coroutine on the event loop and return its result; cancel it if this thread is interrupted."""
        with self._lock:
            if self._closed:
                coroutine.close()
                raise ConnectionClosedError(None, None)
            future = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def _stop(self) -> None:
        asyncio.run_coroutine_threadsafe(_other_tasks(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


async def _connect(uri: str, options: dict[str, Any]) -> ClientConnection:
    return await connect(uri, **options)


async def _other_tasks() -> None:
    """Wait until every other task of the event loop has ended, so that no thread waits for one forever."""
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    await asyncio.gather(*tasks, return_exceptions=True)
