"""Client of a running robot's web UI, for programs: receives its layers and sends commands."""

from __future__ import annotations

import socket
import ssl
import time
import zlib
from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec
import numpy as np
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.ui.access.served_address import own_token
from chefbot.ui.access.tls import client_context
from chefbot.ui.commands import OperatorCommand
from chefbot.ui.protocol import PieceAssembler
from chefbot.ui.remote.blocking_web_socket import BlockingWebSocket
from chefbot.ui.request_guard import COOKIE

CONNECT_TIMEOUT = 5.0
"""Timeout of the connection, s."""
MAX_FRAME, MAX_CELLS = 64_000_000, 100_000_000
"""Maximum size of a frame, bytes, and of a map, cells."""


class ConnectionLostError(UserError):
    """Raised when the connection is closed."""


class WebUiClient:
    """`with WebUiClient("http://127.0.0.1:8080") as page:`; UserError when no robot's web UI answers there.

    One thread may receive while another sends. As long as the connection is open, keep receiving: the server
    disconnects clients that do not read.
    """

    def __init__(self, url: str) -> None:
        self.url = without_token(url)
        """The address as messages name it."""
        self.latest: dict[str, Any] = {}
        """The newest value of each received layer, as returned by `decode`."""
        self._assembler = PieceAssembler(MAX_FRAME)
        self._socket = _connect(url)

    def __enter__(self) -> WebUiClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; a thread that is receiving gets ConnectionLostError."""
        self._socket.close()

    def send(self, command: OperatorCommand) -> None:
        """Send a command; ConnectionLostError if the connection is closed."""
        try:
            self._socket.send(msgspec.json.encode(command).decode())
        except ConnectionClosed:
            raise self._connection_lost() from None

    def receive(self, timeout: float | None = None) -> str:
        """Return the name of the next changed layer; "" if nothing was received in `timeout` seconds.

        Raises UserError with the robot's sentence when it refused a command.
        """
        try:
            layer, value = decode(self._receive_frame(timeout))
        except TimeoutError:
            return ""
        except ConnectionClosed:
            raise self._connection_lost() from None
        except ValueError as error:
            raise _not_a_robot(self.url, error) from None
        if layer == "refused":
            raise UserError(f"the robot at {self.url} refused: {value}")
        self.latest[layer] = value
        return layer

    def _receive_frame(self, timeout: float | None) -> str | bytes:
        """Return the next small layer, or the bulk layer whose last piece is next. Raises TimeoutError."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            message = self._socket.receive(left)
            frame = message if isinstance(message, str) else self._assembler.add(message)
            if frame is not None:
                return frame

    def wait_for(self, layer: str, timeout: float) -> Any:
        """Return the layer's value as soon as it is received; None on timeout after `timeout` seconds."""
        self.wait_until(lambda: self.latest.get(layer) is not None, timeout)
        return self.latest.get(layer)

    def wait_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Receive until the condition holds; return False if it does not within `timeout` seconds."""
        deadline = time.monotonic() + timeout
        while not condition() and (remaining := deadline - time.monotonic()) > 0:
            self.receive(remaining)
        return condition()

    def _connection_lost(self) -> ConnectionLostError:
        return ConnectionLostError(f"the robot at {self.url} has ended or the connection is lost")


def decode(frame: str | bytes) -> tuple[str, Any]:
    """Decode a frame of `wire` to (layer, value), or ("refused", sentence).

    The map is a Grid; other bulk layers, which programs do not use yet, are left as bytes. Raises ValueError
    for an invalid frame.
    """
    try:
        return _decode_text(frame) if isinstance(frame, str) else _decode_bulk(frame)
    except (KeyError, TypeError, msgspec.MsgspecError, zlib.error) as error:
        raise ValueError(f"not a frame of the web UI: {error}") from None


def _decode_text(frame: str) -> tuple[str, Any]:
    message = msgspec.json.decode(frame)
    return ("refused", message["refused"]) if "refused" in message else (message["layer"], message["value"])


def _decode_bulk(frame: bytes) -> tuple[str, Any]:
    # Header length, header, body (see `wire`).
    size = int.from_bytes(frame[:2], "little")
    header, body = msgspec.json.decode(frame[2 : 2 + size]), frame[2 + size :]
    return header["layer"], _grid(header, body) if header["kind"] == "int8" else body


def _grid(header: dict[str, Any], body: bytes) -> Grid:
    height, width = int(header["height"]), int(header["width"])
    if not 0 < height * width <= MAX_CELLS:
        raise ValueError(f"a map of {width} by {height} cells")
    # Limit the decompressed size to that of the cells.
    data = zlib.decompressobj().decompress(body, height * width)
    cells = np.frombuffer(data, np.int8).reshape(height, width)
    return Grid(cells, header["resolution"], header["x"], header["y"])


def without_token(page: str) -> str:
    """Return the address of a web UI without its token, so that no terminal and no log keeps that."""
    return page.split("?", 1)[0]


def _connect(url: str) -> BlockingWebSocket:
    host, port, token, secure = _address(url)
    url, token = without_token(url), token or own_token(host, port)
    try:
        tcp = socket.create_connection((host, port), CONNECT_TIMEOUT)
    except OSError as error:
        raise UserError(
            f"no robot runs at {url} with a web UI: {error.strerror or error}; start one with `chefbot launch` "
            "(with headless:=true it has no web UI), or name the address of its web UI with `--page`"
        ) from None
    url_host = f"[{host}]" if ":" in host else host
    try:
        return BlockingWebSocket(
            f"{'wss' if secure else 'ws'}://{url_host}:{port}/live",
            sock=tcp,
            ssl=client_context() if secure else None,
            additional_headers={"Cookie": f"{COOKIE}={token}"} if token else None,
            open_timeout=CONNECT_TIMEOUT,
            close_timeout=1.0,
            max_size=MAX_FRAME,
        )
    except InvalidStatus as error:
        if error.response.status_code == 403:
            raise UserError(
                f"the robot at {url} refused the connection: give the complete address with ?token= that it printed "
                "at its start, ask for a new link, or close another browser"
            ) from None
        raise _not_a_robot(url, error) from None
    except ssl.SSLError as error:
        raise UserError(f"the certificate of {url} is not trusted: {error.reason or error}") from None
    except TimeoutError:
        raise UserError(
            f"the server at {url} did not answer within {CONNECT_TIMEOUT:g} s; try again"
        ) from None
    except (OSError, WebSocketException) as error:
        raise _not_a_robot(url, error) from None


def _address(url: str) -> tuple[str, int, str, bool]:
    """Return host, port and token of the web UI's address, and whether it is served by TLS."""
    try:
        parts = urlsplit(url if "://" in url else f"http://{url}")
        host, port = parts.hostname, parts.port or (443 if parts.scheme == "https" else 80)
    except ValueError:
        host, port = None, 0
    if not host or parts.scheme not in ("http", "https"):
        raise UserError(f"{url!r} is not the address of a web UI; write it like http://127.0.0.1:8080")
    return host, port, parse_qs(parts.query).get("token", [""])[0], parts.scheme == "https"


def _not_a_robot(url: str, error: Exception) -> UserError:
    return UserError(f"the server at {url} is not a robot's web UI ({error}); check host and port")
