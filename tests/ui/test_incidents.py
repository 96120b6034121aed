"""Incidents in the web UI: saved by a button, listed, and downloaded by operators only."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab

from chefbot.incidents.files import Incident, SavedIncident
from chefbot.ui.access.visitors import GUEST
from chefbot.ui.commands import SaveIncident
from chefbot.ui.display.views import IncidentsView, StatusView
from chefbot.ui.playback.downloads import MCAP
from chefbot.ui.server import WebUiServer

INCIDENT = Incident(robot="chefbot", time="2026-01-31T09:05:00Z", sentence="<b>A box</b>.", by="anna")
SAVED = SavedIncident(name="chefbot-20260131T090500Z.mcap", size=4_200_000, incident=INCIDENT)


def test_a_file_of_the_folder_is_a_download(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"recorded")
    (tmp_path / "secret.txt").write_bytes(b"no")
    server = WebUiServer(0, "127.0.0.1", print, incidents=tmp_path)
    url = server.start()
    try:
        answer = httpx.get(f"{url}incidents/a.mcap")
        assert answer.content == b"recorded" and "attachment" in answer.headers["content-disposition"]
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["content-type"] == MCAP
        for name in ("b.mcap", "secret.txt", "..%2Fsecret.txt", "%2e%2e/a.mcap", "a.mcap%00"):
            assert httpx.get(f"{url}incidents/{name}").status_code == 404
    finally:
        server.stop()


def test_without_a_folder_there_are_no_downloads(page: Any) -> None:
    assert httpx.get(f"{page.url}incidents/a.mcap").status_code == 404


def test_viewers_cannot_download_pictures_of_people(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"recorded")
    server = WebUiServer(0, "0.0.0.0", print, incidents=tmp_path)
    operator = server.start()
    try:
        for address, code in ((operator, 200), (server.url_for(GUEST), 403)):
            with httpx.Client(follow_redirects=True) as browser:
                assert browser.get(address).status_code == 200
                base = address.partition("?")[0]
                assert browser.get(f"{base}incidents/a.mcap").status_code == code
        assert httpx.get(f"{operator.partition('?')[0]}incidents/a.mcap").status_code == 403
    finally:
        server.stop()


@pytest.mark.slow
@needs_chromium
def test_an_incident_is_saved_by_a_button(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("status", StatusView(phase="Waiting."))
    page.server.set_layer("incidents", IncidentsView())
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("document.getElementById('phase').textContent === 'Waiting.'")
        assert tab.evaluate("document.getElementById('incidents-box').hidden")
        tab.evaluate("document.getElementById('incident-note').value = 'It hit a chair'")
        tab.evaluate("document.getElementById('save-incident').click()")
        assert page.next_command() == SaveIncident("It hit a chair")
        failed = IncidentsView(outcome="The incident was not saved: the disk is full.", requests=1)
        page.server.set_layer("incidents", failed)
        tab.wait_for(f"document.getElementById('incident-saved').textContent === '{failed.outcome}'")
        page.server.set_layer("incidents", IncidentsView(saved=(SAVED,), outcome="Saved.", requests=2))
        tab.wait_for("document.getElementById('incident-saved').textContent === 'Saved.'")
        text = tab.evaluate("document.getElementById('incidents').textContent")
        assert text.endswith(", 4.2 MB (anna): <b>A box</b>.")
        assert (
            tab.evaluate("document.querySelector('#incidents a').getAttribute('href')")
            == f"incidents/{SAVED.name}"
        )
        assert tab.errors() == []
