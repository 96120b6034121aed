"""Tests the server of the web UI: latched layers, rejected commands, driving, rate limits and stopping."""

from __future__ import annotations

import json
import socket
import threading
import time
from contextlib import ExitStack, suppress
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from tests.support.waiting import wait_for
from websockets.exceptions import ConnectionClosed

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.ui import client, dead_man
from chefbot.ui.access.client_slots import MAX_FULL_ACCESS, MAX_ONLY_STOP
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.page_access import announcement
from chefbot.ui.commands import Drive, GoPlace, OperatorCommand, Stop
from chefbot.ui.display.views import RobotView, StatusView, StopView
from chefbot.ui.server import ONLY_STOP, WebUiServer
from chefbot.ui.web_ui_params import WebUiParams

LOOPBACK = "127.0.0.1"
PATIENCE = 20.0
GO_TO_KITCHEN = '{"do":"go_place","name":"kitchen"}'


def test_a_late_browser_gets_all_layers(page: Any, receive: Any) -> None:
    page.server.set_layer("map", Grid(np.zeros((3, 4), np.int8), 0.05, 0.0, 0.0))
    page.server.set_layer("places", {"kitchen": (1, 2, 3)})
    page.server.set_layer("status", StatusView(phase="Waiting."))
    page.server.set_layer("status", StatusView(phase="Driving."))
    for _ in range(2):
        with page.browser() as browser:
            seen = dict(receive(browser) for _ in range(3))
            assert set(seen) == {"map", "places", "status"}
            assert seen["status"]["phase"] == "Driving."
            assert seen["places"] == [{"name": "kitchen", "x": 1.0, "y": 2.0, "yaw": 3.0}]


def test_an_invalid_command_is_rejected_and_the_next_accepted(page: Any, receive: Any) -> None:
    with page.browser() as browser:
        for text in ("nonsense", '{"do":"fly"}', b"\x00\x01", '{"do":"goal","x":1e300,"y":0,"yaw":0}'):
            browser.send(text)
            kind, sentence = receive(browser)
            assert (kind, "refused" in sentence) == ("refused", True)
        browser.send('{"do":"stop"}')
        assert page.next_command() == Stop()
    assert page.commands.empty()


def test_a_rejection_by_the_robot_reaches_only_its_operator(page: Any, receive: Any) -> None:
    def reject(command: OperatorCommand) -> None:
        raise UserError("There is no place 'moon'")

    page.on_command = reject
    with page.browser() as first, page.browser() as other:
        first.send('{"do":"go_place","name":"moon"}')
        assert receive(first) == ("refused", "There is no place 'moon'")
        page.on_command = page.commands.put
        other.send('{"do":"go_place","name":"kitchen"}')
        assert page.next_command() == GoPlace("kitchen")
        with pytest.raises(TimeoutError):
            other.recv(timeout=0.2)


def test_a_too_long_message_closes_only_its_connection(page: Any) -> None:
    with page.browser() as big, page.browser() as other:
        big.send("[" + "1," * 40_000 + "1]")
        wait_for(lambda: page.server.clients == 1)
        other.send('{"do":"stop"}')
        assert page.next_command() == Stop()


@pytest.mark.slow
def test_a_client_above_the_rate_limit_is_disconnected(page: Any) -> None:
    with page.browser() as flood, page.browser() as other:
        with suppress(ConnectionClosed):
            for _ in range(int(client.BURST) + 1000):
                flood.send('{"do":"cancel"}')
        wait_for(lambda: page.server.clients == 1)
        assert page.commands.qsize() < client.BURST + 500
        other.send('{"do":"stop"}')
        wait_for(lambda: Stop() in list(page.commands.queue))


@pytest.mark.parametrize("close_handshake", [True, False])
def test_a_disconnected_driver_stops_the_robot(
    page: Any, close_handshake: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dead_man, "COMMAND_TIMEOUT", 60.0)
    with page.browser() as browser:
        browser.send('{"do":"drive","v":0.5,"w":-0.25}')
        assert page.next_command() == Drive(0.5, -0.25)
        if close_handshake:
            browser.close()
        else:
            browser.socket.shutdown(socket.SHUT_RDWR)
        assert page.next_command() == Drive(0.0, 0.0)
    wait_for(lambda: page.server.clients == 0)
    assert page.commands.empty()


@pytest.mark.slow
def test_a_silent_driver_stops_the_robot_and_may_drive_again(page: Any) -> None:
    with page.browser() as browser:
        for _ in range(2):
            browser.send('{"do":"drive","v":1,"w":0}')
            assert page.next_command() == Drive(1.0, 0.0)
            assert page.next_command() == Drive(0.0, 0.0)


def test_only_one_operator_drives_but_anyone_may_stop(
    page: Any, receive: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dead_man, "COMMAND_TIMEOUT", 60.0)
    with page.browser() as driver, page.browser() as other:
        driver.send('{"do":"drive","v":1,"w":0}')
        assert page.next_command() == Drive(1.0, 0.0)
        other.send('{"do":"drive","v":-1,"w":0}')
        other.send('{"do":"stop"}')
        kind, sentence = receive(other)
        assert (kind, "another browser" in sentence) == ("refused", True)
        assert page.next_command() == Stop()


def test_layers_are_rate_limited_and_the_last_value_arrives(page: Any, receive: Any) -> None:
    with page.browser() as browser:
        wait_for(lambda: page.server.clients == 1)
        start = time.monotonic()
        for number in range(20_000):
            page.server.set_layer("robot", RobotView(x=float(number), y=0.0, yaw=0.0))
        seen: list[float] = []
        while not seen or seen[-1] != 19_999:
            seen.append(receive(browser)[1]["x"])
        assert len(seen) <= (time.monotonic() - start) / 0.1 + 2
        assert seen == sorted(seen)


@pytest.mark.slow
def test_a_browser_that_never_reads_is_dropped(
    page: Any, receive: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client, "SEND_TIMEOUT", 5.0)  # the other one, on a busy computer, is faster
    noise = np.random.default_rng(1).integers(0, 100, (4000, 4000), np.int8)
    url = urlsplit(page.url)
    with socket.create_connection((url.hostname, url.port)) as not_reading, page.browser() as other:
        not_reading.sendall(
            f"GET /live HTTP/1.1\r\nHost: {url.netloc}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        wait_for(lambda: page.server.clients == 2)
        page.server.set_layer("map", Grid(noise, 0.05, 0.0, 0.0))
        assert receive(other)[0] == "map"
        page.server.set_layer("status", StatusView(phase="After the map."))
        assert receive(other)[0] == "status"
        wait_for(lambda: page.server.clients == 1)
        page.server.set_layer("status", StatusView(phase="Still here."))
        assert receive(other)[1]["phase"] == "Still here."


def test_stop_works_with_any_number_of_open_screens(page: Any, receive: Any) -> None:
    page.server.set_layer("stop", StopView())
    page.server.set_layer("map", Grid(np.zeros((3, 4), np.int8), 0.05, 0.0, 0.0))
    with ExitStack() as screens:
        for _ in range(MAX_FULL_ACCESS):
            screens.enter_context(page.browser()).send('{"do":"cancel"}')  # somebody works here
            page.next_command()
        late = [screens.enter_context(page.browser()) for _ in range(MAX_ONLY_STOP)]
        assert receive(late[0]) == ("refused", ONLY_STOP)
        assert receive(late[0])[0] == "stop"
        late[0].send(GO_TO_KITCHEN)
        assert receive(late[0]) == ("refused", ONLY_STOP), "it gets no map"
        later = [screens.enter_context(page.browser()) for _ in range(3)]
        for number, screen in enumerate([*late[3:], *later]):
            screen.send(f'{{"do":"stop","id":"{number}"}}')
            assert page.next_command() == Stop(str(number))
        wait_for(lambda: page.server.clients == MAX_FULL_ACCESS + MAX_ONLY_STOP)
        with pytest.raises(ConnectionClosed):
            while True:
                late[0].recv(timeout=PATIENCE)


def test_a_ping_is_answered_after_earlier_frames(page: Any, receive: Any) -> None:
    with page.browser() as browser:
        browser.send(GO_TO_KITCHEN)
        browser.send('{"do":"ping","n":5}')
        assert json.loads(browser.recv(timeout=PATIENCE)) == {"pong": 5}
        assert page.commands.get_nowait() == GoPlace("kitchen")


def test_server_stop_frees_the_port_with_clients_connected() -> None:
    server = WebUiServer(0, LOOPBACK, print)
    port = urlsplit(server.start()).port
    assert port is not None
    idle = socket.create_connection(("127.0.0.1", port))
    idle.sendall(b"GET / HTTP/1.1\r\nHost")
    server.stop()
    server.stop()
    assert "page" not in [thread.name for thread in threading.enumerate()]
    again = WebUiServer(port, LOOPBACK, print)
    assert urlsplit(again.start()).port == port
    again.stop()
    idle.close()


def test_the_next_free_port_is_used_and_announced() -> None:
    first = WebUiServer(0, LOOPBACK, print)
    port = urlsplit(first.start()).port or 0
    second = WebUiServer(port, LOOPBACK, print)
    url = second.start()
    other = urlsplit(url).port or 0
    assert port < other < port + 20 and second.port == other
    in_use = f"Web UI: {url}\n  Port {port} is in use by another program."
    invitations = Invitations("desk")
    assert announcement(second, WebUiParams(port=port), url, invitations) == in_use
    assert announcement(second, WebUiParams(port=other), url, invitations) == f"Web UI: {url}"
    second.stop()
    first.stop()


def test_an_address_of_another_machine_is_reported() -> None:
    with pytest.raises(UserError, match="cannot be served"):
        WebUiServer(8080, "192.0.2.7", print).start()
