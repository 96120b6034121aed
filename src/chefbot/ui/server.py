"""The operator's page: static files and one WebSocket, served from a thread of its own."""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import secrets
import socket
import threading
from collections.abc import AsyncIterator, Callable
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from chefbot.errors import UserError
from chefbot.ui.client import Client
from chefbot.ui.commands import MAX_TEXT, Command, Drive, Ping, Stop, Withdraw, parse_command
from chefbot.ui.dead_man import DeadMan
from chefbot.ui.files import SAFE, content_type, headers_of, static_files
from chefbot.ui.gate import Gate
from chefbot.ui.hub import Hub
from chefbot.ui.protocols import GuardedHttp, GuardedSocket
from chefbot.ui.solids import Solids

TICK = 0.05
PORTS_TO_TRY = 20
MAX_CLIENTS = 16
"""Screens with everything; as many more see little and may press STOP, the newest for the longest there."""
ONLY_STOP = (
    f"{MAX_CLIENTS} other screens are open, so here only STOP works; close one of them and reload this page"
)
STOP_LAYERS = ("stop", "status")
PENALTY = 1.0
"""Seconds for which a flooding client is not listened to before it is dropped, lest it come back at once."""
STOP_LIMIT = 10.0
"""Seconds; it takes a fraction of one, but on a busy machine a thread may wait for its turn."""


class PageServer:
    """Shows layers to browsers and hands their commands to `on_command`.

    `on_command` runs in the page's thread and must return at once (put the command into a queue); a UserError
    that it raises goes as a sentence to the browser that sent the command. Bound to a network address instead
    of loopback, the page asks for a token that only the URL returned by `start` carries. `model` makes the
    robot's solids (GLB); it is called in a thread when somebody looks at them for the first time.
    """

    def __init__(
        self,
        port: int,
        host: str,
        on_command: Callable[[Command], None],
        model: Callable[[], bytes] | None = None,
    ) -> None:
        self._wish = (host, port)
        self._on_command = on_command
        self._hub = Hub()
        self._deadman = DeadMan(on_command)
        self._clients: dict[Client, None] = {}
        self._token = None if _is_loopback(host) else secrets.token_urlsafe(16)
        self._solids = Solids(model)
        self._uvicorn: Any = None
        self._thread: threading.Thread | None = None
        self.app = Gate(self._build_app(), host, self._token)

    def start(self) -> str:
        """Serve; the address to open. If the port is taken, the next free one of twenty is used (0: any)."""
        if self._thread is not None:
            raise UserError("The operator's page is being served already; stop it first")
        listener = _listen(*self._wish)
        self._uvicorn = _uvicorn(self.app)
        self._thread = threading.Thread(
            target=self._serve, args=(listener,), name="operator page", daemon=True
        )
        self._thread.start()
        return self._url(listener)

    def stop(self) -> None:
        """End all connections, free the port. RuntimeError if that takes longer than STOP_LIMIT."""
        if self._thread is None:
            return
        self._uvicorn.should_exit = True
        self._thread.join(STOP_LIMIT)
        if self._thread.is_alive():
            raise RuntimeError("the operator's page did not end in time")
        self._thread = None

    @property
    def clients(self) -> int:
        """How many browsers look on."""
        return len(self._clients)

    def show(self, layer: str, payload: Any) -> None:
        """Set the latest value of a layer; None clears it. Any thread, before or after `start`, never blocks.

        Raises ValueError or TypeError for an unknown layer or a payload of another shape (see `layers`).
        """
        self._hub.show(layer, payload)

    def _build_app(self) -> Starlette:
        files = static_files()

        async def serve_file(request: Request) -> Response:
            name = request.path_params.get("name", "index.html")
            if name not in files:
                return Response("No such file.", 404, SAFE, "text/plain")
            return Response(files[name], 200, headers_of(files[name]), content_type(name))

        routes = [
            Route("/", serve_file),
            WebSocketRoute("/live", self._live),
            Route("/robot.glb", self._solids.serve),
            Route("/{name:path}", serve_file),
        ]
        return Starlette(routes=routes)

    def _url(self, listener: socket.socket) -> str:
        host, port = listener.getsockname()[:2]
        if ipaddress.ip_address(host).is_unspecified:
            host = _own_address()
        shown = f"[{host}]" if ":" in host else host
        return f"http://{shown}:{port}/" + (f"?token={self._token}" if self._token else "")

    def _serve(self, listener: socket.socket) -> None:
        asyncio.run(self._serve_and_publish(listener))

    async def _serve_and_publish(self, listener: socket.socket) -> None:
        publisher = asyncio.create_task(self._publish())
        await self._uvicorn.serve(sockets=[listener])
        publisher.cancel()

    async def _publish(self) -> None:
        """Encode off the event loop, so that a large map delays neither STOP nor the dead man's switch."""
        while True:
            if self._clients:
                changed = await asyncio.to_thread(self._hub.encode_due, asyncio.get_running_loop().time)
                for client in self._clients:
                    client.offer(changed if client.greeted else list(self._hub.frames), STOP_LAYERS)
                    client.greeted = True
            await asyncio.sleep(TICK)

    async def _live(self, web: WebSocket) -> None:
        """The life of one browser's connection."""
        await web.accept()
        client = Client(web, only_stop=sum(not one.only_stop for one in self._clients) >= MAX_CLIENTS)
        if client.only_stop:
            self._make_room()
            client.answer(ONLY_STOP)
        self._clients[client] = None
        try:
            await _first_to_end(
                self._listen_to(client), client.send_forever(self._hub.frames), client.dismissed.wait()
            )
        finally:
            self._clients.pop(client, None)
            self._deadman.leave(client)

    def _make_room(self) -> None:
        """Nobody who holds many connections keeps STOP from others."""
        reserved = [one for one in self._clients if one.only_stop]
        if len(reserved) >= MAX_CLIENTS:
            reserved[0].dismissed.set()
            self._clients.pop(reserved[0])

    @property
    def asks_for_token(self) -> bool:
        """Whether it is served to a network."""
        return self._token is not None

    async def _listen_to(self, client: Client) -> None:
        async for text in _texts(client.socket):
            if not client.may_speak():
                client.answer("This screen sent too many commands and is cut off for a moment")
                await asyncio.sleep(PENALTY)
                return  # without a closing handshake, for which the rest of the flood would have to be read
            self._obey(client, text)

    def _obey(self, client: Client, text: str) -> None:
        try:
            command = parse_command(text)
            if isinstance(command, Ping):
                client.pong(command.n)
            elif client.only_stop and not isinstance(command, Stop | Withdraw):
                raise UserError(ONLY_STOP)
            elif isinstance(command, Drive):
                self._deadman.drive(client, command)
            else:
                self._on_command(command)
        except UserError as error:
            client.answer(str(error))


async def _texts(web: WebSocket) -> AsyncIterator[str]:
    """The messages of a browser until it leaves; bytes become an empty text, which is no command."""
    while (message := await web.receive())["type"] == "websocket.receive":
        yield message.get("text") or ""


async def _first_to_end(*jobs: Any) -> None:
    """Run the jobs until one returns or fails, end the others, and pass a failure on."""
    tasks = [asyncio.ensure_future(job) for job in jobs]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    for task in done:
        task.result()


def _uvicorn(app: Any) -> Any:
    config = uvicorn.Config(
        app,
        http=GuardedHttp,
        ws=GuardedSocket,
        loop="asyncio",
        lifespan="off",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        ws_max_size=MAX_TEXT,
        ws_ping_interval=5.0,
        ws_ping_timeout=5.0,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=0.5,
    )
    return uvicorn.Server(config)


def _listen(host: str, port: int) -> socket.socket:
    """A listening socket on the first free port from `port` on."""
    for candidate in range(port, min(port + PORTS_TO_TRY, 65536)):
        listener = _bind(host, candidate)
        if listener is not None:
            return listener
    raise UserError(f"Ports {port} to {port + PORTS_TO_TRY - 1} of {host} are all taken; name another port")


def _bind(host: str, port: int) -> socket.socket | None:
    """A listening socket, or None when the port is taken."""
    try:
        return socket.create_server((host, port), family=_family(host), backlog=64)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            return None
        raise UserError(f"The page cannot be served at {host}:{port}: {error.strerror or error}") from None


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def _own_address() -> str:
    """This machine's address in the network (by a UDP socket that sends nothing); loopback without one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
