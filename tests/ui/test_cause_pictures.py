"""Pictures of causes in the web UI: of the recorded ones, shown when an entry is opened, for operators only."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from PIL import Image
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab

from chefbot.storage.cause_records import CauseRecords, Moment
from chefbot.ui.access.visitors import GUEST
from chefbot.ui.causes.cause_pictures import HEADERS
from chefbot.ui.causes.cause_views import recorded_cause_views
from chefbot.ui.server import WebUiServer


def picture() -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (320, 240), (10, 120, 60)).save(out, "PNG")
    return out.getvalue()


@pytest.fixture
def records(tmp_path: Path) -> CauseRecords:
    records = CauseRecords(tmp_path / "one.sqlite")
    records.add(Moment(effect="Stopped", sentence="A box.", map=picture()), simulated=False)
    return records


@pytest.fixture
def server(records: CauseRecords) -> Iterator[WebUiServer]:
    server = WebUiServer(0, "127.0.0.1", print, history=records.path)
    server.start()
    yield server
    server.stop()


@pytest.mark.slow
def test_a_picture_is_served_once(server: WebUiServer) -> None:
    url = f"http://127.0.0.1:{server.port}/causes"
    answer = httpx.get(f"{url}/1/map")
    assert answer.content == picture() and answer.headers["content-type"] == "image/png"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["cache-control"] == HEADERS["cache-control"]
    for name in ("1/camera", "2/map", "1/sentence", "-1/map", "99999999999999999999/map", "a/map"):
        assert httpx.get(f"{url}/{name}").status_code == 404, name


@pytest.mark.parametrize("content", [None, b"not a database" * 100])
def test_without_a_readable_history_there_are_no_pictures(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "none.sqlite"
    if content:
        path.write_bytes(content)
    server = WebUiServer(0, "127.0.0.1", print, history=path)
    url = server.start()
    try:
        assert httpx.get(f"{url}causes/1/map").status_code == 404
    finally:
        server.stop()
    assert path.exists() == bool(content)


@pytest.mark.slow
def test_viewers_cannot_see_pictures_of_people(records: CauseRecords) -> None:
    server = WebUiServer(0, "0.0.0.0", print, history=records.path)
    operator = server.start()
    try:
        for address, code in ((operator, 200), (server.url_for(GUEST), 403)):
            with httpx.Client(follow_redirects=True) as browser:
                assert browser.get(address).status_code == 200
                assert browser.get(f"{address.partition('?')[0]}causes/1/map").status_code == code
        assert httpx.get(f"{operator.partition('?')[0]}causes/1/map").status_code == 403
    finally:
        server.stop()


@pytest.mark.slow
@needs_chromium
def test_an_entry_of_an_earlier_run_has_its_date_and_picture(
    server: WebUiServer, records: CauseRecords
) -> None:
    show_a_room(server)
    server.set_layer("causes", recorded_cause_views(records.causes(5)))
    with open_tab(f"http://127.0.0.1:{server.port}/", NO_GPU) as tab:
        tab.wait_for("document.querySelectorAll('#causes > li').length === 1")
        head = tab.evaluate("document.querySelector('#causes summary').textContent")
        assert head.endswith(" Stopped: A box.") and head.count("/") == 2
        assert not tab.evaluate("document.querySelector('#causes img').complete")
        tab.evaluate("document.querySelector('[data-tab=health]').click()")
        tab.evaluate("document.querySelector('#causes details').open = true")
        tab.evaluate("document.querySelector('#causes').scrollIntoView()")
        tab.wait_for("document.querySelector('#causes img').naturalWidth === 320")
        assert tab.errors() == []
