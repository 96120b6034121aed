"""Tests of invited persons: their links outlast a launch, end when they are revoked, and are of one robot."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.security.test_strangers import refusal
from tests.support.waiting import PATIENCE, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from chefbot.devices import state_files
from chefbot.errors import UserError
from chefbot.storage.atomic_files import StorageError
from chefbot.ui.access.identification import Identification
from chefbot.ui.access.invitations import MAX_NAME, MAX_PEOPLE, Invitations, InvitedPerson
from chefbot.ui.access.served_address import LINK, served_robots, write_address
from chefbot.ui.access.visitors import TokenKey, Visitor
from chefbot.ui.commands import Cancel, OperatorCommand, Stop
from chefbot.ui.server import REVOKED, WebUiServer

ROBOT = "desk"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(state_files.VARIABLE, str(tmp_path))
    return tmp_path


class Served:
    """The web UI of a robot at the network; it records commands with who gave them."""

    def __init__(self, robot: str = ROBOT, names: tuple[str, ...] = ()) -> None:
        self.commands: list[tuple[OperatorCommand, str]] = []
        self.server = WebUiServer(
            0,
            "0.0.0.0",
            lambda command, who: self.commands.append((command, who)),
            invitations=Invitations(robot),
            names=names,
        )
        self.port = httpx.URL(self.server.start()).port

    def get(self, token: str = "", cookie: str = "", host: str = "") -> httpx.Response:
        headers = ({"cookie": cookie} if cookie else {}) | ({"host": host} if host else {})
        params = {"token": token} if token else None
        return httpx.get(f"http://127.0.0.1:{self.port}/", params=params, headers=headers, timeout=PATIENCE)

    def cookie(self, token: str) -> str:
        return str(self.get(token).headers["set-cookie"]).partition(";")[0]

    def browser(self, token: str) -> ClientConnection:
        url, headers = f"ws://127.0.0.1:{self.port}/live", {"Cookie": self.cookie(token)}
        return connect(url, additional_headers=headers, open_timeout=PATIENCE, max_size=None)


@pytest.fixture
def served() -> Iterator[Served]:
    one = Served()
    yield one
    one.server.stop()


def test_an_invited_person_is_recognized_on_every_launch() -> None:
    token = Invitations(ROBOT).invite("Café Zoë", "waiter")
    for _ in range(2):
        served = Served()
        first = served.get(token)
        assert first.status_code == 303 and re.search("max-age=[0-9]{8}", first.headers["set-cookie"].lower())
        with served.browser(token) as browser:
            browser.send('{"do":"cancel"}')
            wait_for(lambda one=served: one.commands == [(Cancel(), "Café Zoë")])  # type: ignore[misc]
            browser.send('{"do":"drop_box","x":1,"y":2}')
            assert "a waiter" in refusal(browser)
        served.server.stop()


@pytest.mark.slow
def test_a_revoked_person_keeps_stop_until_disconnected(served: Served) -> None:
    invitations = Invitations(ROBOT)
    token, other = invitations.invite("anna", "waiter"), invitations.invite("ben", "waiter")
    with served.browser(token) as anna, served.browser(other) as ben:
        invitations.revoke("anna")
        assert refusal(anna) == REVOKED
        anna.send('{"do":"cancel"}')
        anna.send('{"do":"stop","id":"a"}')
        wait_for(lambda: (Stop("a"), "anna") in served.commands)
        with pytest.raises(ConnectionClosed):
            while True:
                anna.recv(timeout=PATIENCE)
        ben.send('{"do":"cancel"}')
        wait_for(lambda: (Cancel(), "ben") in served.commands)
    assert (Cancel(), "anna") not in served.commands
    assert served.get(token).status_code == 403 and "no longer valid" in served.get(token).text
    assert served.get(other).status_code == 303


@pytest.mark.slow
def test_a_new_link_or_role_replaces_the_older_one(served: Served) -> None:
    invitations = Invitations(ROBOT)
    old = invitations.invite("anna", "waiter")
    with served.browser(old) as browser:
        new = invitations.invite("anna", "guest")
        assert refusal(browser) == REVOKED
    assert served.get(old).status_code == 403 and served.get(new).status_code == 303
    assert [(person.name, person.role) for person in invitations.people()] == [("anna", "guest")]


@pytest.mark.slow
def test_robots_at_one_host_do_not_end_each_others_sessions(served: Served) -> None:
    """Cookies are of a host, whatever the port."""
    other = Served("bench")
    first = served.cookie(Invitations(ROBOT).invite("anna", "waiter"))
    second = other.cookie(Invitations("bench").invite("anna", "guest"))
    both = f"{second}; {first}"
    assert served.get(cookie=both).status_code == other.get(cookie=both).status_code == 200
    assert served.get(cookie=second).status_code == other.get(cookie=first).status_code == 403
    other.server.stop()


def test_an_old_address_does_not_lock_out_who_has_a_cookie(served: Served) -> None:
    cookie = served.cookie(Invitations(ROBOT).invite("anna", "waiter"))
    assert served.get("of an ended launch", cookie).status_code == 200


def test_a_reverse_proxy_serves_the_page_at_its_name() -> None:
    served = Served(names=("robot.example.org",))
    token = Invitations(ROBOT).invite("anna", "waiter")
    page = served.get(token, host="robot.example.org")
    assert page.status_code == 303 and "; secure" in page.headers["set-cookie"].lower()
    assert served.get(token, host="evil.example.org").status_code == 403
    served.server.stop()


def test_the_file_contains_no_token_and_is_the_owners(folder: Path) -> None:
    invitations = Invitations(ROBOT)
    token = invitations.invite("anna", "waiter")
    text = invitations.path.read_text()
    assert invitations.path.is_relative_to(folder) and invitations.path.stat().st_mode & 0o077 == 0
    assert "anna" in text and token not in text
    assert served_robots() == [ROBOT]


def test_a_link_is_the_owners_before_it_has_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    modes: dict[str, int] = {}
    replace = os.replace

    def note_mode(source: Path, target: Path) -> None:
        modes[target.suffix] = source.stat().st_mode
        replace(source, target)

    monkeypatch.setattr(os, "replace", note_mode)
    write_address(ROBOT, "http://192.168.1.7:8080/?token=secret")
    assert modes[LINK] & 0o077 == 0


@pytest.mark.parametrize("data", [b"", b"{}", b'[{"name": "anna"}]', b'[{"name": 1}]', b"\xff"])
def test_damaged_invitations_let_nobody_in_and_are_kept(served: Served, data: bytes) -> None:
    invitations = Invitations(ROBOT)
    token = invitations.invite("anna", "engineer")
    invitations.path.write_bytes(data)
    assert served.get(token).status_code == 403
    for change in (lambda: invitations.invite("ben", "guest"), lambda: invitations.revoke("anna")):
        with pytest.raises(StorageError, match=r"desk\.people\.json cannot be read: .*restore the file"):
            change()
    assert invitations.path.read_bytes() == data


@pytest.mark.parametrize("name", ["", " anna", "anna ", "a\nb", "a\x00", "x" * (MAX_NAME + 1)])
def test_invalid_names_are_reported_in_one_sentence(name: str) -> None:
    with pytest.raises(UserError, match="1 to 40 printable characters"):
        Invitations(ROBOT).invite(name, "guest")


def test_revoking_a_person_who_is_not_invited_names_the_others() -> None:
    invitations = Invitations(ROBOT)
    with pytest.raises(UserError, match="nobody is"):
        invitations.revoke("anna")
    invitations.invite("anna", "guest")
    with pytest.raises(UserError, match="did you mean 'anna'"):
        invitations.revoke("ana")


def test_names_are_the_same_however_they_were_typed() -> None:
    invitations = Invitations(ROBOT)
    invitations.invite("Zoe\u0308", "guest")
    invitations.revoke("Zoë")
    assert invitations.people() == ()


def test_invitations_damaged_in_a_run_are_a_warning() -> None:
    warnings: list[str] = []
    invitations = Invitations(ROBOT, warnings.append)
    token = invitations.invite("anna", "guest")
    invitations.path.write_bytes(b"{")
    assert Identification(TokenKey("a secret of this test"), invitations).visitor(token) is None
    assert "cannot be read" in warnings[0]


def test_the_number_of_persons_is_limited() -> None:
    invitations = Invitations(ROBOT)
    invitations.invite("first", "guest")
    people = [
        InvitedPerson(f"n{number}", "guest", "2026-01-01T00:00:00+00:00", "") for number in range(MAX_PEOPLE)
    ]
    invitations.path.write_bytes(msgspec.json.encode(people))
    with pytest.raises(UserError, match="revoke some of them first"):
        Invitations(ROBOT).invite("one more", "guest")
    Invitations(ROBOT).invite("n0", "waiter")  # an invited person gets a new link


@given(st.text(max_size=60))
def test_no_other_token_is_an_invited_persons(token: str) -> None:
    invitations = Invitations("of_this_test")
    given_token = invitations.invite("anna", "engineer")
    assert invitations.visitor(given_token) == Visitor("anna", "engineer")
    assert token == given_token or invitations.visitor(token) is None
