"""Tests the client of the web UI: decoding, commands, and errors without a robot."""

from __future__ import annotations

import http.server
import socket
import stat
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.fake_robot import fake_robot
from tests.support.waiting import PATIENCE

from chefbot.devices.state_files import VARIABLE
from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.ui import protocol
from chefbot.ui.access.served_address import own_token, write_address
from chefbot.ui.commands import Drive, Goal, Stop
from chefbot.ui.display.views import StatusView
from chefbot.ui.remote import web_ui_client
from chefbot.ui.remote.web_ui_client import ConnectionLostError, WebUiClient, decode
from chefbot.ui.server import WebUiServer

SIZES = st.tuples(st.integers(1, 20), st.integers(1, 20))


@given(SIZES, st.integers(0, 99), st.floats(0.01, 1.0), st.floats(-50, 50))
def test_a_map_round_trips(size: tuple[int, int], seed: int, resolution: float, x: float) -> None:
    cells = np.random.default_rng(seed).integers(-1, 101, size).astype(np.int8)
    layer, grid = decode(protocol.grid("map", protocol.GridImage(cells, resolution, x, 1.0)))
    assert layer == "map"
    assert np.array_equal(grid.cells, cells)
    assert (grid.resolution, grid.origin_x, grid.origin_y) == (resolution, x, 1.0)


@given(st.binary(max_size=80) | st.text(max_size=40))
def test_an_invalid_frame_raises_value_error(frame: bytes | str) -> None:
    with pytest.raises(ValueError):
        decode(frame)


@given(st.integers(0, 60), st.integers(0, 255))
def test_a_corrupt_map_raises_value_error_or_decodes(position: int, byte: int) -> None:
    frame = bytearray(protocol.grid("map", protocol.GridImage(np.zeros((3, 4), np.int8), 0.05, 0.0, 0.0)))
    frame[position] = byte
    try:
        layer, value = decode(bytes(frame))
    except ValueError:
        return
    assert isinstance(layer, str)
    assert isinstance(value, bytes) or (value.cells.dtype == np.int8 and 0 < value.cells.size <= 12)


def test_a_map_with_a_wrong_size_in_its_header_is_rejected() -> None:
    frame = protocol.grid("map", protocol.GridImage(np.zeros((1000, 1000), np.int8), 0.05, 0.0, 0.0))
    inconsistent = frame.replace(b'"width":1000,"height":1000', b'"width":9000,"height":9999')
    with pytest.raises(ValueError):
        decode(inconsistent)


def test_layers_are_received_and_commands_sent() -> None:
    with fake_robot() as robot, WebUiClient(robot.url) as page:
        assert page.wait_for("status", PATIENCE)["phase"] == "Waiting."
        assert page.wait_for("map", 0.05) is None
        grid = robot.show_map()
        shown = page.wait_for("map", PATIENCE)
        assert isinstance(shown, Grid)
        assert np.array_equal(shown.cells, grid.cells)
        for command in (Stop(), Goal(1.0, 2.0, 0.5), Drive(-0.5, 1.0)):
            page.send(command)
            assert robot.commands.get(timeout=PATIENCE) == command


def test_a_robot_shutdown_is_reported() -> None:
    with fake_robot() as robot, WebUiClient(robot.url) as page:
        robot.server.stop()
        with pytest.raises(ConnectionLostError, match="has ended"):
            while True:
                page.receive(20)
        with pytest.raises(ConnectionLostError):
            page.send(Stop())


@pytest.mark.parametrize(
    "url", ["", "http://", "ftp://127.0.0.1", "http://127.0.0.1:99999", "http://[::1", "a b://"]
)
def test_an_invalid_address_is_rejected(url: str) -> None:
    with pytest.raises(UserError, match="not the address of a web UI"):
        WebUiClient(url)


def test_a_closed_port_means_no_running_robot() -> None:
    with fake_robot() as robot:
        url = robot.url
    with pytest.raises(UserError, match=r"no robot runs at .*chefbot launch"):
        WebUiClient(url)


class OtherServer(http.server.BaseHTTPRequestHandler):
    """A web server that is not a web UI."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"hello")

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture
def other_server() -> Iterator[str]:
    server = http.server.HTTPServer(("127.0.0.1", 0), OtherServer)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.mark.slow
def test_another_server_is_not_taken_for_a_robot(other_server: str) -> None:
    with pytest.raises(UserError, match="not a robot's web UI"):
        WebUiClient(other_server)


@pytest.mark.slow
def test_a_server_that_is_silent_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_ui_client, "CONNECT_TIMEOUT", 0.5)
    with (
        socket.create_server(("127.0.0.1", 0)) as silent,
        pytest.raises(UserError, match=r"did not answer within 0\.5 s"),
    ):
        WebUiClient(f"http://127.0.0.1:{silent.getsockname()[1]}")


def test_who_served_a_page_needs_no_token_on_its_computer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    server = WebUiServer(0, "0.0.0.0", print)
    url = server.start()
    address = f"http://127.0.0.1:{server.port}"
    try:
        write_address("earlier", f"http://127.0.0.1:{server.port + 1}/?token=other")
        with pytest.raises(UserError, match=r"\?token="):
            WebUiClient(address)
        write_address("bench", url)
        assert stat.S_IMODE((tmp_path / "page" / "bench.link").stat().st_mode) == 0o600
        for own in (address, f"localhost:{server.port}", url.partition("?")[0]):
            WebUiClient(own).close()
        assert own_token("192.0.2.1", server.port) == "", "no other host gets it"
    finally:
        server.stop()


def test_a_network_page_requires_its_token() -> None:
    server = WebUiServer(0, "0.0.0.0", print)
    url = server.start()
    try:
        with pytest.raises(UserError, match=r"\?token="):
            WebUiClient(url.partition("?")[0])
        with pytest.raises(UserError) as refusal:
            WebUiClient(f"{url.partition('?')[0]}?token=secret")
        assert "secret" not in str(refusal.value)
        server.set_layer("status", StatusView(phase="Here."))
        with WebUiClient(url) as page:
            assert page.url == url.partition("?")[0], "messages name it so"
            assert page.wait_for("status", PATIENCE)["phase"] == "Here."
    finally:
        server.stop()
