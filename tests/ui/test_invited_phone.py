"""An invited person's phone: it keeps the link, shows the web UI without the robot, and reports a revoked link."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab

from chefbot.devices import state_files
from chefbot.ui.access.addresses import host_names
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.visitors import GUEST
from chefbot.ui.display.views import DeliveryView, StatusView, StopView
from chefbot.ui.files import static_files
from chefbot.ui.request_guard import INVALID_TOKEN
from chefbot.ui.server import REVOKED, WebUiServer

NAME = next(name for name in host_names() if name.endswith(".local"))
"""The name of this computer with which a phone in its network finds it."""
UP = "!document.body.classList.contains('offline')"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(state_files.VARIABLE, str(tmp_path))
    yield


def serve(port: int = 0) -> tuple[WebUiServer, int]:
    server = WebUiServer(port, "0.0.0.0", lambda *_: None, invitations=Invitations("desk"))
    show_a_room(server)
    return server, httpx.URL(server.start()).port or 0


def flags(port: int) -> list[str]:
    """Options with which Chromium finds the name here, and takes it for as safe as https."""
    safe = f"--unsafely-treat-insecure-origin-as-secure=http://{NAME}:{port}"
    return [*NO_GPU, f"--host-resolver-rules=MAP {NAME} 127.0.0.1", safe]


@pytest.mark.rotated("invited phone")
@pytest.mark.slow
@needs_chromium
def test_the_page_opens_without_the_robot() -> None:
    server, port = serve()
    token = Invitations("desk").invite("anna", "waiter")
    with open_tab(f"http://{NAME}:{port}/?token={token}", flags(port)) as tab:
        tab.wait_for(f"{UP} && document.body.dataset.role === 'waiter'")
        tab.wait_for("caches.open('page').then((cache) => cache.match('/')).then(Boolean)")
        tab.wait_for("caches.open('page').then((cache) => cache.match('/app.js')).then(Boolean)")
        tab.wait_for("navigator.serviceWorker.ready.then(() => navigator.serviceWorker.controller !== null)")
        server.stop()
        tab.reload_by("location.reload()")
        tab.wait_for(
            "/connect/i.test(document.getElementById('phase').textContent)"
        )  # connecting, or no connection
        assert tab.evaluate("document.body.dataset.role") == "waiter", "an engineer's tools are not shown"
        tab.click("#stop")
        tab.wait_for("document.getElementById('stop').textContent.includes('not confirmed')")
        server, _ = serve(port)
        tab.wait_for(f"{UP} && document.body.dataset.role === 'waiter'")
    server.stop()


@pytest.mark.rotated("invited phone")
@pytest.mark.slow
@needs_chromium
def test_the_page_reports_a_revoked_link() -> None:
    server, port = serve()
    invitations = Invitations("desk")
    token = invitations.invite("anna", "waiter")
    with open_tab(f"http://{NAME}:{port}/?token={token}", flags(port)) as tab:
        tab.wait_for(f"{UP} && document.body.dataset.role === 'waiter'")
        assert tab.evaluate("document.querySelector('[data-tab=drive]').textContent") == "Camera"
        server.set_layer("status", StatusView(warnings=("Wire: messages are lost on /odom", "Battery: low")))
        tab.wait_for("document.getElementById('warnings').textContent === 'Battery: low'")
        server.set_layer("stop", StopView(stopped=True))
        tab.wait_for("document.body.classList.contains('stopped')")
        invitations.revoke("anna")
        tab.wait_for(f"document.body.textContent.includes({json.dumps(REVOKED)})")
        tab.wait_for(f"!({UP})")
        tab.wait_for(f"document.getElementById('notice').textContent === {json.dumps(INVALID_TOKEN)}")
        assert tab.evaluate(
            "document.getElementById('panels').inert && document.getElementById('notice-close').hidden"
        )
        assert not tab.evaluate("document.body.classList.contains('stopped')"), "nobody here knows"
        tab.evaluate("location.hash = '#kiosk'")
        tab.wait_for(f"document.getElementById('kiosk-text').textContent === {json.dumps(INVALID_TOKEN)}")
        token = invitations.invite("anna", "waiter")
        tab.reload_by(f"location.href = '/?token={token}'")
        tab.wait_for(f"{UP} && document.body.dataset.role === 'waiter'")
    server.stop()


@pytest.mark.rotated("invited phone")
@pytest.mark.slow
@needs_chromium
def test_a_guest_reads_nothing_that_only_staff_can_do() -> None:
    """The robot's sentences are for who may release STOP; a guest is to call those."""
    server, _ = serve()
    phase = "document.getElementById('phase').textContent"
    with open_tab(server.url_for(GUEST), NO_GPU) as tab:
        tab.wait_for(f"{UP} && document.body.dataset.role === 'guest'")
        server.set_layer("status", StatusView(phase="On the way to table 2."))
        tab.wait_for(f"{phase} === 'On the way to table 2.'")
        server.set_layer(
            "status", StatusView(phase="Kept; release STOP.", stopped=True, reason="Release STOP.")
        )
        tab.wait_for(f"{phase} === 'The robot is stopped. Please call the staff.'")
        assert "release STOP" not in tab.evaluate("document.body.innerText")
        server.set_layer("status", StatusView(phase="Choose."))
        server.set_layer(
            "delivery", DeliveryView(step="Choose.", guest_step="Please call the staff.", waits_for="choice")
        )
        tab.wait_for(f"{phase} === 'Please call the staff.'")
        assert "Choose" not in tab.evaluate("document.body.innerText")
        assert not tab.evaluate("document.body.classList.contains('waits')")
    server.stop()


@pytest.mark.rotated("invited phone")
def test_the_manifest_names_files_that_are_served() -> None:
    manifest = json.loads(static_files()["manifest.json"])
    assert {icon["src"].removeprefix("./") for icon in manifest["icons"]} <= set(static_files())
    assert manifest["start_url"] == "/" and manifest["display"] == "standalone"
