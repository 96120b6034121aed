"""Tests the web UI with a certificate of the fleet: who trusts it, and strangers in the TLS handshake."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import httpx
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from tests.support.waiting import PATIENCE, wait_for
from websockets.exceptions import InvalidStatus

from chefbot.errors import UserError
from chefbot.fleet.keyring import Keyring
from chefbot.ui import http_limits
from chefbot.ui.access import listener, page_access
from chefbot.ui.access.address_limits import MAX_STRANGERS_PER_KNOWN_ADDRESS
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.tls import client_context, load_tls
from chefbot.ui.commands import OperatorCommand, Stop
from chefbot.ui.remote import web_ui_client
from chefbot.ui.remote.blocking_web_socket import BlockingWebSocket
from chefbot.ui.remote.web_ui_client import WebUiClient
from chefbot.ui.server import WebUiServer
from chefbot.ui.web_ui_params import WebUiParams


class Site(NamedTuple):
    server: WebUiServer
    url: str
    commands: list[OperatorCommand]

    @property
    def port(self) -> int:
        return httpx.URL(self.url).port or 0

    @property
    def cookie(self) -> dict[str, str]:
        return {"Cookie": f"chefbot={httpx.URL(self.url).params['token']}"}


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Site]:
    monkeypatch.setenv("CHEFBOT_KEYS", str(tmp_path / "keys"))
    # The tests' own handshakes may take long on a slow machine.
    monkeypatch.setattr(listener, "STRANGER_TIMEOUT", PATIENCE)
    monkeypatch.setattr(web_ui_client, "CONNECT_TIMEOUT", PATIENCE)
    Keyring(tmp_path / "keys").create_fleet("hotel", datetime.now(UTC))
    commands: list[OperatorCommand] = []
    server = WebUiServer(0, "0.0.0.0", lambda command, _: commands.append(command), tls=load_tls("fleet"))
    url = httpx.URL(server.start())
    yield Site(server, str(url.copy_with(host="127.0.0.1")), commands)
    server.stop()


def test_a_member_trusts_the_page_and_others_do_not(
    site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with WebUiClient(site.url) as robot:
        robot.send(Stop("a"))
        wait_for(lambda: site.commands == [Stop("a")])
    monkeypatch.setenv("CHEFBOT_KEYS", str(tmp_path / "elsewhere"))
    with pytest.raises(UserError, match=r"the certificate of .* is not trusted"):
        WebUiClient(site.url)
    Keyring(tmp_path / "elsewhere").create_fleet("other", datetime.now(UTC))
    with pytest.raises(UserError, match=r"the certificate of .* is not trusted"):
        WebUiClient(site.url)


def test_the_cookie_is_for_https_and_its_own_origin(site: Site) -> None:
    context = client_context()
    first = httpx.get(site.url, verify=context, timeout=PATIENCE)
    assert first.status_code == 303 and "secure" in first.headers["set-cookie"].lower()
    live, host = f"wss://127.0.0.1:{site.port}/live", f"127.0.0.1:{site.port}"
    options = {"ssl": context, "additional_headers": site.cookie, "open_timeout": PATIENCE}
    with closing(BlockingWebSocket(live, origin=f"https://{host}", **options)):
        wait_for(lambda: site.server.clients == 1)
    with pytest.raises(InvalidStatus, match="403"):
        BlockingWebSocket(live, origin=f"http://{host}", **options)
    named = httpx.get(
        f"https://127.0.0.1:{site.port}/",
        headers={**site.cookie, "Host": "site.local"},
        verify=context,
        timeout=PATIENCE,
    )
    assert named.status_code == 200, "a name of the certificate"


@pytest.mark.slow
def test_strangers_in_the_handshake_lock_nobody_out(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listener, "STRANGER_TIMEOUT", 2.0)
    with ExitStack() as stack:
        strangers = [
            stack.enter_context(socket.create_connection(("127.0.0.1", site.port), PATIENCE))
            for _ in range(80)
        ]
        for stranger in strangers[::2]:
            stranger.sendall(b"\x16\x03\x01\x02\x00")  # the beginning of a ClientHello
        wait_for(lambda: site.server._uvicorn.limits.refused >= 80 - MAX_STRANGERS_PER_KNOWN_ADDRESS)
        monkeypatch.setattr(listener, "STRANGER_TIMEOUT", PATIENCE)
        with WebUiClient(site.url) as robot:
            robot.send(Stop("b"))
            wait_for(lambda: site.commands == [Stop("b")])
        for stranger in strangers:
            with suppress(ConnectionError):
                assert stranger.recv(1000) in (b"", b"\x15")
        plain = stack.enter_context(socket.create_connection(("127.0.0.1", site.port), PATIENCE))
        plain.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert b"HTTP" not in plain.recv(1000)
    wait_for(lambda: not site.server._uvicorn.limits._strangers)


@pytest.mark.slow
def test_a_tls_connection_without_an_end_is_not_an_error(
    site: Site, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(listener, "STRANGER_TIMEOUT", 1.0)
    monkeypatch.setattr(http_limits, "STALL_TIMEOUT", 0.3)
    request = f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{site.port}\r\nCookie: {site.cookie['Cookie']}\r\n"
    request += "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    request += "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    with (
        socket.create_connection(("127.0.0.1", site.port), PATIENCE) as raw,
        client_context().wrap_socket(raw, server_hostname="127.0.0.1") as web,
    ):
        web.sendall(request.encode())
        wait_for(lambda: site.server.clients == 1)
        web.sendall(b"\x88\x80\x00\x00\x00\x00")  # closes the web socket, not the TLS connection
        wait_for(lambda: site.server.clients == 0)
        wait_for(lambda: not site.server._uvicorn.server_state.connections)
    assert not caplog.records


def test_a_certificate_comes_with_its_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_KEYS", str(tmp_path / "keys"))
    assert load_tls("") is None
    with pytest.raises(UserError, match="belongs to no fleet"):
        load_tls("fleet")
    with pytest.raises(UserError, match=r"private key of .*robot\.pem is not at .*robot\.key"):
        load_tls(str(tmp_path / "robot.pem"))
    (tmp_path / "robot.key").write_text("nonsense")
    (tmp_path / "robot.pem").write_text("nonsense")
    with pytest.raises(UserError, match="holds no certificate"):
        load_tls(str(tmp_path / "robot.pem"))
    Keyring(tmp_path / "keys").create_fleet("hotel", datetime.now(UTC))
    (tmp_path / "robot.pem").write_bytes((tmp_path / "keys" / "me.pem").read_bytes())
    with pytest.raises(UserError, match=r"robot\.key is not the private key of"):
        load_tls(str(tmp_path / "robot.pem"))


@pytest.mark.parametrize("kind", ["rsa", "p384"])
def test_a_certificate_of_another_authority_may_have_any_key(tmp_path: Path, kind: str) -> None:
    key = rsa.generate_private_key(65537, 2048) if kind == "rsa" else ec.generate_private_key(ec.SECP384R1())
    name, now = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "robot.local")]), datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder(name, name, key.public_key(), 7, now, now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName("robot.local")]), critical=False)
        .sign(key, hashes.SHA256())
    )
    (tmp_path / "robot.pem").write_bytes(certificate.public_bytes(Encoding.PEM))
    private = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    (tmp_path / "robot.key").write_bytes(private)
    tls = load_tls(str(tmp_path / "robot.pem"))
    assert tls is not None and tls.names == ("robot.local",)


def test_the_start_warns_where_traffic_can_be_read(site: Site) -> None:
    encrypted, invitations = WebUiParams(certificate="fleet"), Invitations("desk")
    lines = page_access.announcement(site.server, encrypted, site.url, invitations)
    assert "Warning" not in lines and "For guests: https://" in lines
    plain = page_access.announcement(site.server, WebUiParams(), site.url, invitations)
    assert page_access.NOT_ENCRYPTED in plain
    local = WebUiServer(0, "127.0.0.1", print)
    url = local.start()
    assert page_access.announcement(local, WebUiParams(port=0), url, invitations) == f"Web UI: {url}"
    local.stop()


def test_tls_versions_that_are_broken_are_refused(site: Site) -> None:
    assert site.server._uvicorn.config.ssl.minimum_version >= ssl.TLSVersion.TLSv1_2
