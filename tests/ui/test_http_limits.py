"""Tests that the web UI rejects foreign hosts and origins, unknown paths, floods, and clients without a token."""

from __future__ import annotations

import base64
import hashlib
import json
import posixpath
import re
import socket
from importlib import resources
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from tests.support.waiting import PATIENCE
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from chefbot.ui.access import address_limits, listener
from chefbot.ui.files import static_files
from chefbot.ui.server import WebUiServer

REFERENCE = re.compile(
    r"""(?:from ?|import\(|register\()["'](\.[\w/.]+)["']|(?:src|href)="([\w.]+)"|: ?"(\./[\w/.]+)\""""
)
STATIC = resources.files("chefbot.ui") / "static"


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "", "[", "a@evil.example"]
)
def test_a_foreign_host_header_is_rejected(page: Any, host: str) -> None:
    answer = httpx.get(page.url, headers={"host": host})
    assert answer.status_code in (400, 403)
    assert "<html" not in answer.text


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1", ""]
)
def test_a_foreign_origin_is_rejected(page: Any, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        page.browser(additional_headers={"Origin": origin})
    assert page.server.clients == 0


def test_the_own_origin_is_accepted(page: Any) -> None:
    with page.browser(origin=page.url.rstrip("/")) as browser:
        browser.send('{"do":"taken"}')
        page.next_command()


@pytest.mark.parametrize(
    "path",
    [
        *(
            "../server.py",
            "..%2fserver.py",
            "%2e%2e/server.py",
            "vendor/three/../../../server.py",
            "/etc/passwd",
        ),
        *("static/style.css", "style.css%00", "vendor", "vendor/three/LICENSE", "model/../model"),
    ],
)
def test_only_web_ui_files_are_served(page: Any, path: str) -> None:
    url = urlsplit(page.url)
    with socket.create_connection((url.hostname, url.port), timeout=PATIENCE) as raw:
        raw.sendall(f"GET /{path} HTTP/1.1\r\nHost: {url.netloc}\r\nConnection: close\r\n\r\n".encode())
        answer = b"".join(iter(lambda: raw.recv(65536), b""))
    assert answer.split()[1] == b"404"
    assert b"import" not in answer


@pytest.mark.slow
def test_every_referenced_file_is_served_with_strict_headers(page: Any) -> None:
    files = static_files()
    languages = re.search(r"LANGUAGES = \{(.*?)\}", files["language.js"].decode())
    assert languages is not None
    codes = set(re.findall(r"(\w+):", languages[1])) - {"en"}
    referenced = {"index.html", *(f"languages/{code}.json" for code in codes)}
    for path in files:
        answer = httpx.get(page.url + path)
        assert answer.status_code == 200
        assert "default-src 'none'" in answer.headers["content-security-policy"]
        for name in REFERENCE.findall(answer.text):
            referenced.add(posixpath.normpath(posixpath.join(posixpath.dirname(path), "".join(name))))
    assert referenced == set(files), "each served file is referenced and each referenced file is served"


def test_only_the_inline_scripts_of_the_page_may_run(page: Any) -> None:
    """They are what loads it again if a file did not arrive, and the import map, which names no other host."""
    answer = httpx.get(page.url)
    inline = re.findall(r"<script(?![^>]* src=)[^>]*>(.*?)</script>", answer.text, re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in inline]
    policy = answer.headers["content-security-policy"]
    assert re.findall(r"'sha256-([^']+)'", policy) == digests
    assert len(digests) == 2
    assert "unsafe" not in policy
    assert all("://" not in address for address in json.loads(inline[1])["imports"].values())
    assert "://" not in inline[0]
    assert "sha256" not in httpx.get(page.url + "app.js").headers["content-security-policy"]


def test_the_vendored_library_has_its_licence_and_version() -> None:
    folder = STATIC / "vendor" / "three"
    version = re.search(r"three@([\d.]+)", (folder / "README.md").read_text())
    assert version
    assert "MIT" in (folder / "LICENSE").read_text()
    revision = version[1].split(".")[1]
    assert re.search(rf'="{revision}"', (folder / "three.core.min.js").read_text())


def test_no_name_can_inject_markup() -> None:
    markup = re.compile(rb"innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(")
    own = {path: text for path, text in static_files().items() if not path.startswith("vendor/")}
    assert [path for path, text in own.items() if markup.search(text)] == []


def test_an_idle_connection_is_closed(page: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listener, "STRANGER_TIMEOUT", 0.2)
    url = urlsplit(page.url)
    with socket.create_connection((url.hostname, url.port), timeout=PATIENCE) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nX-Slow: ")
        assert _ended(slow)


@pytest.mark.slow
def test_a_flood_of_connections_is_limited_for_others_only(
    page: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(address_limits, "MAX_STRANGERS_PER_KNOWN_ADDRESS", 4)
    monkeypatch.setattr(listener, "STRANGER_TIMEOUT", 0.5)
    url = urlsplit(page.url)
    with page.browser() as operator:
        flood = [socket.create_connection((url.hostname, url.port), timeout=PATIENCE) for _ in range(40)]
        operator.send('{"do":"stop"}')
        page.next_command()
        assert all(_ended(connection) for connection in flood)
        assert httpx.get(page.url).status_code == 200
        for connection in flood:
            connection.close()


def _ended(connection: socket.socket) -> bool:
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


def test_on_a_network_only_the_token_opens_the_page() -> None:
    server = WebUiServer(0, "0.0.0.0", print)
    url = urlsplit(server.start())
    base = f"http://127.0.0.1:{url.port}"
    live = f"ws://127.0.0.1:{url.port}/live"
    assert httpx.get(f"{base}/").status_code == 403
    assert httpx.get(f"{base}/?token=wrong").status_code == 403
    assert httpx.get(f"{base}/app.js?{url.query}").status_code == 403
    with pytest.raises(InvalidStatus, match="403"):
        connect(f"{live}?{url.query}")
    with httpx.Client(base_url=base) as browser:
        assert browser.get(f"/?{url.query}").status_code == 303
        assert browser.get("/").status_code == 200
        cookie = f"chefbot={browser.cookies['chefbot']}"
    with connect(live, additional_headers={"Cookie": cookie}):
        pass
    server.stop()
