"""Tests that strangers with real sockets lock no operator out, cannot delay STOP, and are dropped when slow."""

from __future__ import annotations

import json
import logging
import socket
import struct
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from tests.support.waiting import PATIENCE, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from chefbot.maths.grid import Grid
from chefbot.ui import http_limits
from chefbot.ui.access import address_limits, client_slots, listener
from chefbot.ui.access.audit_log import AuditEntry, AuditLog, read_entries
from chefbot.ui.access.client_slots import MAX_FULL_ACCESS, MAX_GUESTS, MAX_ONLY_STOP
from chefbot.ui.access.roles import ONLY_VIEW
from chefbot.ui.access.visitors import ENGINEER, GUEST, Visitor
from chefbot.ui.commands import Cancel, Drive, OperatorCommand, Stop
from chefbot.ui.display.views import StatusView
from chefbot.ui.server import ONLY_STOP, WebUiServer

SLOW = b"GET / HTTP/1.1\r\nX-Slow: "
STOP_CPU_S = 0.1
UPGRADE = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


class Site:
    """A web UI at the network that records commands; `audit` holds what its log contains."""

    def __init__(self, folder: Path) -> None:
        self.commands: list[OperatorCommand] = []
        self.log = AuditLog(folder / "robot.jsonl", print, print)
        self.server = WebUiServer(
            0, "0.0.0.0", lambda command, _: self.commands.append(command), audit=self.log
        )
        self.port = httpx.URL(self.server.start()).port or 0
        self.stack = ExitStack()

    def close(self) -> None:
        self.stack.close()
        self.server.stop()
        self.log.close()

    def audit(self) -> list[AuditEntry]:
        return list(read_entries(self.log.path))

    def cookie(self, visitor: Visitor = ENGINEER) -> dict[str, str]:
        return {"Cookie": f"chefbot={httpx.URL(self.server.url_for(visitor)).params['token']}"}

    def browser(self, visitor: Visitor = ENGINEER) -> ClientConnection:
        url = f"ws://127.0.0.1:{self.port}/live"
        options: dict[str, Any] = {"open_timeout": PATIENCE, "max_size": None}
        return self.stack.enter_context(connect(url, additional_headers=self.cookie(visitor), **options))

    def raw(self, data: bytes = b"") -> socket.socket:
        one = self.stack.enter_context(socket.create_connection(("127.0.0.1", self.port), PATIENCE))
        one.sendall(data)
        return one

    @property
    def open_connections(self) -> int:
        return len(self.server._uvicorn.server_state.connections)


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    served = Site(tmp_path)
    yield served
    served.close()


def ended(connection: socket.socket) -> bool:
    """Read until the connection ends; False if it does not within PATIENCE."""
    try:
        while connection.recv(65536):
            pass
    except ConnectionError:
        pass
    except TimeoutError:
        return False
    return True


def refusal(browser: ClientConnection) -> str:
    """Return the next refusal that a browser gets."""
    while True:
        data = browser.recv(timeout=PATIENCE)
        if isinstance(data, str) and "refused" in json.loads(data):
            return str(json.loads(data)["refused"])


@pytest.mark.slow
def test_80_slow_strangers_lock_nobody_out(site: Site) -> None:
    operator = site.browser()
    strangers = [site.raw(SLOW) for _ in range(80)]
    began = time.monotonic()
    for _ in range(25):
        answer = httpx.get(f"http://127.0.0.1:{site.port}/", headers=site.cookie(), timeout=PATIENCE)
        assert answer.status_code == 200
    with site.browser() as newcomer:
        newcomer.send('{"do":"cancel"}')
        wait_for(lambda: Cancel() in site.commands)
    assert time.monotonic() - began < PATIENCE
    used = time.process_time()
    operator.send('{"do":"stop"}')
    wait_for(lambda: Stop() in site.commands)
    assert time.process_time() - used < STOP_CPU_S
    assert all(map(ended, strangers))


def test_a_stranger_gets_one_answer_and_no_web_socket(site: Site) -> None:
    asking = site.raw(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n" * 3)
    answer = b"".join(iter(lambda: asking.recv(65536), b""))
    assert answer.count(b"403 Forbidden") == 1 and b"connection: close" in answer.lower()
    upgrading = site.raw(f"GET /live HTTP/1.1\r\nHost: localhost\r\n{UPGRADE}".encode())
    assert b"403" in upgrading.recv(100) and ended(upgrading)
    assert site.server.clients == 0


@pytest.mark.parametrize(
    "data",
    [
        SLOW,
        b"POST / HTTP/1.1\r\nHost: localhost\r\n%sContent-Length: 60000\r\n\r\nabc",
        b"GET /app.js HTTP/1.1\r\nHost: localhost\r\n%s\r\nGET / HTTP/1.1\r\nX-Slow: ",
    ],
    ids=["header", "body", "second header"],
)
@pytest.mark.slow
def test_slow_requests_are_dropped(site: Site, data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listener, "STRANGER_TIMEOUT", 0.5)
    monkeypatch.setattr(http_limits, "REQUEST_TIMEOUT", 0.5)
    cookie = f"Cookie: {site.cookie()['Cookie']}\r\n".encode()
    slow = site.raw(data % cookie if b"%s" in data else data)
    assert ended(slow)
    wait_for(lambda: site.open_connections == 0)


@pytest.mark.slow
def test_a_peer_that_never_reads_is_dropped(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_limits, "STALL_TIMEOUT", 0.3)
    library = "vendor/three/three.core.min.js"
    request = f"GET /{library} HTTP/1.1\r\nHost: localhost\r\nCookie: {site.cookie()['Cookie']}\r\n\r\n"
    not_reading = socket.socket()
    not_reading.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    with not_reading:
        not_reading.connect(("127.0.0.1", site.port))
        not_reading.sendall(request.encode() * 20)
        wait_for(lambda: site.open_connections == 1)
        wait_for(lambda: site.open_connections == 0)


@pytest.mark.slow
def test_a_web_socket_that_never_reads_gets_no_queue(site: Site) -> None:
    """What it has not read is overwritten by newer states, and it is disconnected in 5 s."""
    request = f"GET /live HTTP/1.1\r\nHost: localhost\r\nCookie: {site.cookie()['Cookie']}\r\n{UPGRADE}"
    silent = site.raw(request.encode())
    wait_for(lambda: site.server.clients == 1)
    began, number = time.monotonic(), 0
    noise = np.random.default_rng(1).integers(0, 100, (500, 500), np.int8)
    while site.server.clients:
        number += 1
        site.server.set_layer("map", Grid(noise, 0.05, float(number), 0.0))
        site.server.set_layer("status", StatusView(phase=f"{number}"))
        time.sleep(0.02)
        assert time.monotonic() - began < PATIENCE
    silent.close()


def test_guests_see_and_stop_but_do_not_drive(site: Site) -> None:
    guest = site.browser(Visitor("tablet", "guest"))
    for command in ('{"do":"drive","v":1,"w":0}', '{"do":"release_stop"}', '{"do":"map_saved","file":"a"}'):
        guest.send(command)
        assert refusal(guest) == ONLY_VIEW
    guest.send('{"do":"stop","id":"a"}')
    wait_for(lambda: site.commands == [Stop("a")])
    wait_for(lambda: [entry.action for entry in site.audit()][-1:] == ["stop"])
    entry = site.audit()[-1]
    assert (entry.name, entry.role, entry.address, entry.refused) == ("tablet", "guest", "127.0.0.1", "")
    assert [e.action for e in site.audit() if e.refused == ONLY_VIEW] == [
        "drive",
        "release_stop",
        "map_saved",
    ]


@pytest.mark.slow
def test_who_commands_gets_in_where_guests_took_all(site: Site) -> None:
    guests = [site.browser(GUEST) for _ in range(MAX_FULL_ACCESS + MAX_ONLY_STOP)]
    wait_for(lambda: site.server.clients == MAX_GUESTS + MAX_ONLY_STOP)
    operators = [site.browser() for _ in range(MAX_FULL_ACCESS)]
    for operator in operators:
        operator.send('{"do":"drive","v":0,"w":0}')
        operator.send('{"do":"cancel"}')
    wait_for(lambda: site.commands.count(Cancel()) == MAX_FULL_ACCESS)
    connected = [guest for guest in guests if _answers(guest)]
    assert len(connected) == MAX_ONLY_STOP, "who is connected keeps STOP"


def _answers(browser: ClientConnection) -> bool:
    try:
        browser.send('{"do":"ping","n":1}')
        while '"pong"' not in str(browser.recv(timeout=PATIENCE)):
            pass
    except ConnectionClosed:
        return False
    return True


@pytest.mark.slow
def test_idle_operators_make_room_and_keep_stop(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program that holds all slots without doing anything, as after a fault of its own."""
    holders = [site.browser() for _ in range(MAX_FULL_ACCESS)]
    wait_for(lambda: site.server.clients == MAX_FULL_ACCESS)
    newcomer = site.browser()
    newcomer.send('{"do":"drive","v":1,"w":0}')
    wait_for(lambda: Drive(1.0, 0.0) in site.commands)
    assert refusal(holders[0]) == ONLY_STOP
    holders[0].send('{"do":"stop","id":"b"}')
    wait_for(lambda: Stop("b") in site.commands)
    # on a busy computer the answers take as long as they like, so it is established by its age alone
    monkeypatch.setattr(client_slots._Slot, "is_established", lambda slot, now: now - slot.since >= 0.5)
    time.sleep(0.5)
    for _ in range(3 * MAX_ONLY_STOP):
        assert _answers(holders[0])
        site.browser().send('{"do":"cancel"}')
    assert _answers(holders[0]), "an established screen is not replaced"


@pytest.mark.slow
def test_a_flood_of_commands_hides_no_stop(site: Site) -> None:
    for _ in range(8):
        with suppress(ConnectionClosed), site.browser() as flood:
            for _ in range(500):
                flood.send('{"do":"cancel"}')
    operator = site.browser()
    operator.send('{"do":"stop","id":"c"}')
    operator.send('{"do":"stop","id":"c"}')
    wait_for(lambda: "stop" in [entry.action for entry in site.audit()])
    entries = site.audit()
    assert [entry.details for entry in entries if entry.action == "stop"] == [{"id": "c"}]
    assert sum(entry.action == "cancel" for entry in entries) <= 400
    token = site.cookie()["Cookie"].partition("=")[2]
    assert token not in site.log.path.read_text()


def test_connections_above_the_rate_are_reset(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(address_limits, "KNOWN_RATE", 0.0)
    monkeypatch.setattr(address_limits, "KNOWN_BURST", 5.0)
    connections = [site.raw() for _ in range(5)]
    time.sleep(0.2)
    # while it connects, or with its first byte
    with (
        pytest.raises(ConnectionResetError),
        socket.create_connection(("127.0.0.1", site.port), PATIENCE) as reset,
    ):
        reset.sendall(SLOW)
        reset.recv(1)
    assert site.server._uvicorn.limits.refused >= 1
    assert len(connections) == 5


def test_limits_forget_every_connection_that_ended(site: Site) -> None:
    for data in (SLOW, b"nonsense\r\n\r\n", b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b""):
        site.raw(data).close()
    with httpx.Client(base_url=f"http://127.0.0.1:{site.port}", headers=site.cookie()) as phone:
        assert [phone.get(path).status_code for path in ("/", "/app.js", "/none")] == [200, 200, 404]
    with site.browser() as browser:
        browser.send('{"do":"stop"}')
        wait_for(lambda: site.commands == [Stop()])
    limits, slots = site.server._uvicorn.limits, site.server._slots
    wait_for(lambda: not limits._strangers and not limits._visitors and not slots._slots)
    assert site.open_connections == 0


def test_invalid_requests_do_not_fill_the_log(site: Site, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(50):
        assert ended(site.raw(b"\x16\x03\x01\x00\xff nonsense\r\n\r\n"))
    for number in range(50):
        logging.getLogger("uvicorn.error").error("fault %d", number)
    assert len(caplog.records) <= listener.LOG_BURST


def test_a_reset_before_the_acceptance_does_no_harm(site: Site) -> None:
    for _ in range(50):
        one = socket.create_connection(("127.0.0.1", site.port), PATIENCE)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        one.close()
    assert httpx.get(f"http://127.0.0.1:{site.port}/", headers=site.cookie()).status_code == 200
