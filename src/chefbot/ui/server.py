"""Server of the web UI: static files and one WebSocket per browser, in its own thread."""

from __future__ import annotations

import asyncio
import ipaddress
import socket
import threading
from collections.abc import AsyncIterator, Callable, Collection
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from chefbot.errors import ChefbotError, UserError, name_hint
from chefbot.ui.access.address_limits import address_group
from chefbot.ui.access.addresses import host_names, is_loopback, listening_socket, own_address
from chefbot.ui.access.audit_log import AuditLog
from chefbot.ui.access.client_slots import MAX_FULL_ACCESS, ClientSlots
from chefbot.ui.access.command_audit import CommandAudit
from chefbot.ui.access.identification import Identification
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.kiosk_lock import KioskLock
from chefbot.ui.access.listener import GuardedServer
from chefbot.ui.access.roles import refusal as refusal_by_role
from chefbot.ui.access.tls import MIN_TLS, Tls
from chefbot.ui.access.visitors import ENGINEER, TokenKey, Visitor
from chefbot.ui.causes.cause_pictures import CausePictureEndpoint
from chefbot.ui.client import BrowserConnection
from chefbot.ui.commands import (
    MAX_TEXT,
    Drive,
    LeaveKiosk,
    OperatorCommand,
    Ping,
    Received,
    Show,
    Stop,
    Withdraw,
    parse_command,
)
from chefbot.ui.dead_man import DeadManSwitch
from chefbot.ui.files import plain_text, served_files
from chefbot.ui.http_limits import GuardedHttp, GuardedSocket
from chefbot.ui.hub import LayerStore
from chefbot.ui.layers import LAYERS
from chefbot.ui.playback.downloads import IncidentEndpoint
from chefbot.ui.received_pings import ReceivedPings
from chefbot.ui.request_guard import COOKIE, RequestGuard
from chefbot.ui.solids import SolidsEndpoint
from chefbot.ui.stop_endpoint import StopEndpoint

TICK = 0.05
"""Period at which changed layers are encoded, s."""
ONLY_STOP = (
    f"{MAX_FULL_ACCESS} other screens are open, so only STOP works here; "
    "close one of them and reload this page"
)
REVOKED = "This link was revoked, or its role changed; reload this page, or ask for a new link"
REVOCATION_PERIOD = 1.0
"""Period at which tokens of connected clients are checked, s."""
PENALTY = 1.0
"""Time for which a client above the rate limit is ignored before it is disconnected, s, so that it does not
reconnect at once."""
PING_INTERVAL, PING_TIMEOUT = 2.0, 3.0
"""Interval of the pings of web sockets and timeout of their answers, s: a browser that is silent for 5 s is
disconnected."""
STOP_TIMEOUT = 10.0
"""Timeout of `stop`, s; it takes a fraction of a second, but on a loaded machine threads are delayed."""


class WebUiServer:
    """Sends layers to browsers and passes their commands to `on_command`, each with the name or role of who gave it.

    `on_command` runs in the server's thread and must return at once (put the command into a queue); a
    ChefbotError that it raises is sent as a sentence to the browser that sent the command. Bound to a network
    address instead of loopback, the server requires a token that only the URLs of `start` and `url_for` contain.
    `model` generates the robot's solids (GLB); it is called in a thread on the first request. `incidents`: folder
    whose files managers can download; `history`: file with the causes whose pictures are shown. `invitations`:
    persons with tokens of their own. `names`: host names at which a reverse proxy serves it by https.
    """

    def __init__(
        self,
        port: int,
        host: str,
        on_command: Callable[[OperatorCommand, str], None],
        model: Callable[[], bytes] | None = None,
        audit: AuditLog | None = None,
        tls: Tls | None = None,
        kiosk_pin: str = "",
        incidents: Path | None = None,
        history: Path | None = None,
        invitations: Invitations | None = None,
        names: Collection[str] = (),
    ) -> None:
        self._address = (host, port)
        self._on_command = on_command
        self._hub = LayerStore()
        self._deadman = DeadManSwitch(self._on_drive)
        self._clients: dict[BrowserConnection, None] = {}
        self._slots: ClientSlots[BrowserConnection] = ClientSlots()
        self._audit = CommandAudit(audit)
        self._tls = tls
        self._kiosk_lock = KioskLock(kiosk_pin)
        self._pings = ReceivedPings()
        self._key = None if is_loopback(host) else TokenKey.from_environment()
        self._identification = Identification(self._key, invitations) if self._key else None
        self._stop = StopEndpoint(on_command, self._audit)
        self._solids = SolidsEndpoint(model)
        self._incidents = IncidentEndpoint(incidents)
        self._cause_pictures = CausePictureEndpoint(history)
        self._uvicorn: Any = None
        self._thread: threading.Thread | None = None
        self._listener: socket.socket | None = None
        own_names = {host, *host_names(), *(tls.names if tls else ())}
        cookie = f"{COOKIE}_{invitations.robot}" if invitations else COOKIE
        self.app = RequestGuard(self._build_app(), own_names, names, self._identification, cookie)

    def start(self) -> str:
        """Start the server and return the URL to open. If the port is in use, the next free one of twenty is
        used (0: any)."""
        if self._thread is not None:
            raise UserError("The web UI is already being served; stop it first")
        self._listener = listener = listening_socket(*self._address)
        self._uvicorn = _uvicorn(self.app, self._tls)
        self._thread = threading.Thread(
            target=self._serve, args=(listener,), name="operator page", daemon=True
        )
        self._thread.start()
        return self.url_for(ENGINEER)

    def stop(self) -> None:
        """Close all connections and free the port; RuntimeError if that takes longer than STOP_TIMEOUT."""
        if self._thread is None:
            return
        self._uvicorn.should_exit = True
        self._thread.join(STOP_TIMEOUT)
        if self._thread.is_alive():
            raise RuntimeError("the web UI server did not end in time")
        self._thread = None

    @property
    def port(self) -> int:
        """Port on which it listens, once it is started: the requested one, or the next free one."""
        assert self._listener is not None, "it is started"
        return int(self._listener.getsockname()[1])

    @property
    def clients(self) -> int:
        """Number of browsers that are connected."""
        return len(self._clients)

    def set_layer(self, layer: str, payload: Any) -> None:
        """Set the latest value of a layer; None clears the layer. Thread-safe, before or after `start`, never
        blocks.

        Raises ValueError or TypeError for an unknown layer or a payload of the wrong type or shape (see
        `layers`).
        """
        self._hub.set_layer(layer, payload)

    def _build_app(self) -> Starlette:
        files = served_files()

        async def serve_file(request: Request) -> Response:
            name = request.path_params.get("name", "index.html")
            if name not in files:
                return plain_text("No such file.", 404)
            return files[name].response(request)

        routes = [
            Route("/", serve_file),
            WebSocketRoute("/live", self._live),
            Route("/stop", self._stop.serve, methods=["POST"]),
            Route("/robot.glb", self._solids.serve),
            Route("/incidents/{name}", self._incidents.serve),
            Route("/causes/{number:int}/{kind}", self._cause_pictures.serve),
            Route("/{name:path}", serve_file),
        ]
        return Starlette(routes=routes)

    def url_for(self, visitor: Visitor) -> str:
        """Return the address to open for a visitor, once the server is started."""
        assert self._listener is not None, "it is started"
        host, port = self._listener.getsockname()[:2]
        if ipaddress.ip_address(host).is_unspecified:
            host = own_address()
        url_host = f"[{host}]" if ":" in host else host
        scheme = "https" if self._tls else "http"
        return f"{scheme}://{url_host}:{port}/" + (f"?token={self._key.token(visitor)}" if self._key else "")

    def _serve(self, listener: socket.socket) -> None:
        asyncio.run(self._serve_and_publish(listener))

    async def _serve_and_publish(self, listener: socket.socket) -> None:
        jobs = [asyncio.create_task(job) for job in (self._publish(), self._end_revoked())]
        await self._uvicorn.serve(sockets=[listener])
        for job in jobs:
            job.cancel()

    async def _publish(self) -> None:
        """Encode outside the event loop, so that a large map delays neither an emergency stop nor the
        dead-man switch."""
        while True:
            if self._clients:
                changed = await asyncio.to_thread(self._hub.encode_due, asyncio.get_running_loop().time)
                for client in self._clients:
                    client.mark_changed(changed if client.initialized else list(self._hub.frames))
                    client.initialized = True
            await asyncio.sleep(TICK)

    async def _end_revoked(self) -> None:
        """Leave clients whose token is not valid any more only STOP, and disconnect them at the next check."""
        while self._identification is not None:
            await asyncio.sleep(REVOCATION_PERIOD)
            for client in list(self._clients):
                if self._identification.visitor(client.token) == client.visitor:
                    continue
                if client.revoked:
                    client.disconnected.set()
                client.revoked = True
                client.demote(REVOKED)

    async def _live(self, web: WebSocket) -> None:
        """Serve one browser's connection until either side closes it."""
        await web.accept()
        visitor, peer = web.state.visitor, web.state.peer
        peer.leave()  # it has a slot of its own from now on
        client = BrowserConnection(web, visitor, peer.host, web.state.token)
        if (shown := web.query_params.get("layers")) is not None:
            client.show(shown.split(","), ())
        if page := web.query_params.get("page", ""):
            client.page = page
            client.greet(self._pings.server, self._pings.last(page), self._hub.has_value("map"))
        self._admit(client)
        self._audit.connected(client)
        try:
            await _run_until_first_ends(
                self._receive_loop(client), client.send_forever(self._hub.frames), client.disconnected.wait()
            )
        finally:
            self._clients.pop(client, None)
            self._slots.remove(client)
            self._deadman.disconnect(client)
            self._audit.disconnected(client)

    def _admit(self, client: BrowserConnection) -> None:
        """Give a client its slot; a client without full access may still stop the robot."""
        now = asyncio.get_running_loop().time()
        name, role = client.visitor
        admission = self._slots.admit(client, role, f"{address_group(client.address)} {name}", now)
        for other in (*admission.demoted, *(() if admission.full_access else (client,))):
            other.demote(ONLY_STOP)
        for other in admission.dropped:
            other.disconnected.set()
            self._clients.pop(other)
        self._clients[client] = None

    @property
    def requires_token(self) -> bool:
        """Whether clients need the token, as the server is bound to a network address."""
        return self._key is not None

    async def _receive_loop(self, client: BrowserConnection) -> None:
        async for text in _receive_texts(client.socket):
            self._slots.note_message(client, asyncio.get_running_loop().time())
            if not client.within_rate_limit():
                client.send_refusal("This browser sent too many commands and is ignored for a moment")
                # Rate limit exceeded: ignore the client for a moment, then disconnect it. Its slot is free at
                # once, else a few programs that reconnect would hold all slots.
                self._slots.remove(client)
                await asyncio.sleep(PENALTY)
                return  # without a closing handshake, for which the rest of the flood would have to be read
            self._execute(client, text)

    def _execute(self, client: BrowserConnection, text: str) -> None:
        try:
            command = parse_command(text)
        except ChefbotError as error:
            client.send_refusal(str(error))
            return
        if self._serve_view(client, command):
            return
        refusal = ""
        try:
            self._pass_on(client, command)
        except ChefbotError as error:
            refusal = str(error)
            client.send_refusal(refusal)
        self._audit.command(client, command, refusal)

    def _serve_view(self, client: BrowserConnection, command: OperatorCommand) -> bool:
        """Return whether the command concerns only what this browser is sent, and carry it out then."""
        if isinstance(command, Ping):
            client.pong(command.n)
            self._pings.note(client.page, command.n)
        elif isinstance(command, Show):
            for name in command.layers:
                if name not in LAYERS:
                    client.send_refusal(f"There is no layer {name!r}{name_hint(name, LAYERS)}")
            client.show(command.layers, list(self._hub.frames))
        elif isinstance(command, Received):
            client.note_received(command.n)
        else:
            return False
        return True

    def _pass_on(self, client: BrowserConnection, command: OperatorCommand) -> None:
        """Pass a command on to the robot. Raises UserError if this client may not give it."""
        if why := refusal_by_role(client.visitor.role, command):
            raise UserError(why)
        if client.only_stop and not isinstance(command, Stop | Withdraw):
            raise UserError(ONLY_STOP)
        now = asyncio.get_running_loop().time()
        self._slots.note_command(client, now)
        if isinstance(command, LeaveKiosk):
            self._kiosk_lock.check(command.pin, now)
        elif isinstance(command, Drive):
            self._deadman.drive(client, command)
        else:
            name, role = client.visitor
            self._on_command(command, name or role)

    def _on_drive(self, command: Drive) -> None:
        self._audit.driver(self._deadman.driver)
        self._on_command(command, "")  # also of nobody: it ends when the driver is silent


async def _receive_texts(web: WebSocket) -> AsyncIterator[str]:
    """Yield the messages of a browser until it disconnects; a binary message becomes an empty text, which is
    an invalid command."""
    while (message := await web.receive())["type"] == "websocket.receive":
        yield message.get("text") or ""


async def _run_until_first_ends(*jobs: Any) -> None:
    """Run the jobs until one returns or fails, cancel the others, and raise its exception."""
    tasks = [asyncio.ensure_future(job) for job in jobs]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    for task in done:
        task.result()


def _uvicorn(app: Any, tls: Tls | None) -> GuardedServer:
    config = uvicorn.Config(
        app,
        http=GuardedHttp,
        ws=GuardedSocket,
        loop="asyncio",
        lifespan="off",
        log_config=None,
        log_level="error",  # an invalid request is not a fault of this program
        access_log=False,
        proxy_headers=False,
        server_header=False,
        ws_max_size=MAX_TEXT,
        ws_ping_interval=PING_INTERVAL,
        ws_ping_timeout=PING_TIMEOUT,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=0.5,
        ssl_certfile=tls.certificate if tls else None,
        ssl_keyfile=tls.key if tls else None,
    )
    config.load()  # here, so that an error is raised to the caller
    if config.ssl is not None:
        config.ssl.minimum_version = MIN_TLS
    return GuardedServer(config)
