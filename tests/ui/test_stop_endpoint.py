"""The emergency stop by an HTTP request: who may send it, and that nothing else is accepted there."""

from __future__ import annotations

import asyncio
import queue
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
from starlette.requests import Request
from tests.support.waiting import PATIENCE

from chefbot.ui import stop_endpoint
from chefbot.ui.access.audit_log import AuditLog, read_entries
from chefbot.ui.access.command_audit import CommandAudit
from chefbot.ui.access.token_bucket import TokenBucket
from chefbot.ui.access.visitors import GUEST
from chefbot.ui.commands import OperatorCommand, Stop
from chefbot.ui.server import WebUiServer
from chefbot.ui.stop_endpoint import BURST, StopEndpoint

PRESS = {"do": "stop", "id": "one press"}


class Served:
    """A served web UI with the commands that it passes on."""

    def __init__(self, host: str, audit: AuditLog | None = None) -> None:
        self.commands: queue.Queue[tuple[OperatorCommand, str]] = queue.Queue()
        self.server = WebUiServer(0, host, self._take, audit=audit)
        self.server.start()
        self.url = f"http://127.0.0.1:{self.server.port}"

    def _take(self, command: OperatorCommand, who: str) -> None:
        self.commands.put((command, who))

    def post(self, body: object, **headers: str) -> httpx.Response:
        return httpx.post(f"{self.url}/stop", json=body, headers=headers)


@pytest.fixture
def served() -> Iterator[Served]:
    one = Served("127.0.0.1")
    yield one
    one.server.stop()


def test_a_press_is_passed_on_with_its_id(served: Served) -> None:
    assert served.post(PRESS, Origin=served.url).status_code == 204
    assert served.commands.get(timeout=PATIENCE)[0] == Stop("one press")


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ({"do": "cancel"}, "Only STOP"),
        ({"do": "stop", "id": 7}, "refused"),
        ([], "refused"),
        ("stop", "refused"),
    ],
)
def test_nothing_but_stop_is_accepted(served: Served, body: object, sentence: str) -> None:
    answer = served.post(body)
    assert answer.status_code == 400 and sentence in answer.text
    assert served.commands.empty()


def test_the_audit_log_has_presses_and_refused_commands(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "robot.jsonl", pytest.fail, pytest.fail)
    served = Served("127.0.0.1", log)
    try:
        served.post(PRESS)
        served.post({"do": "cancel"})
    finally:
        served.server.stop()
        log.close()
    entries = [(one.action, bool(one.refused)) for one in read_entries(log.path)]
    assert entries == [("stop", False), ("cancel", True)]


def test_a_page_of_another_site_stops_nothing(served: Served) -> None:
    assert served.post(PRESS, Origin="http://another.example").status_code == 403
    assert httpx.get(f"{served.url}/stop").status_code in (404, 405)
    assert served.commands.empty()


def test_a_flood_of_one_address_is_refused(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stop_endpoint, "REQUESTS_PER_SECOND", 1e-6)
    answers = [served.post({"do": "stop", "id": str(n)}).status_code for n in range(round(BURST) + 1)]
    assert answers == [204] * round(BURST) + [429]


def test_on_a_network_a_guest_may_stop_and_a_stranger_not() -> None:
    served = Served("0.0.0.0")
    try:
        assert served.post(PRESS).status_code == 403
        token = httpx.URL(served.server.url_for(GUEST)).params["token"]
        with httpx.Client() as phone:
            phone.get(f"{served.url}/", params={"token": token})
            assert phone.post(f"{served.url}/stop", json=PRESS).status_code == 204
        assert served.commands.get(timeout=PATIENCE) == (Stop("one press"), "guest")
    finally:
        served.server.stop()


def test_a_bucket_refills_with_time() -> None:
    bucket = TokenBucket(rate=2.0, burst=3.0, now=0.0)
    assert [bucket.take(0.0) for _ in range(4)] == [True, True, True, False]
    assert bucket.take(1.0) and not bucket.take(1.0)


def test_a_request_that_breaks_off_stops_nothing_and_is_no_error() -> None:
    commands: list[OperatorCommand] = []
    endpoint = StopEndpoint(lambda command, _: commands.append(command), CommandAudit(None))

    async def receive() -> dict[str, str]:
        return {"type": "http.disconnect"}

    peer = SimpleNamespace(host="192.0.2.1")
    scope = {"type": "http", "method": "POST", "headers": [], "state": {"visitor": GUEST, "peer": peer}}
    response = asyncio.run(endpoint.serve(Request(scope, receive)))
    assert response.status_code == 400 and commands == []
