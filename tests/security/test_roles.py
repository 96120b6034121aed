"""Tests of the roles of the web UI: each command has one, the robot checks it, the web UI offers what it may do."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from tests.security.test_strangers import Site, refusal
from tests.support.waiting import PATIENCE, wait_for
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab

from chefbot.ui import commands as do
from chefbot.ui.access.roles import LAYER_ROLE, NEEDED_ROLE, ONLY_VIEW, ROLES, hidden_layers, may
from chefbot.ui.access.roles import refusal as refusal_by_role
from chefbot.ui.access.visitors import Role, Visitor
from chefbot.ui.display.views import DeliveryView, IncidentsView, StopView
from chefbot.ui.layers import LAYERS

SERVES, DRIVES, CHANGES = do.Deliver(("table_1",)), do.Drive(0.1, 0.0), do.DropBox(1.0, 2.0)
ALLOWED: dict[Role, int] = {"guest": 0, "waiter": 1, "manager": 2, "engineer": 3}
"""How many of the three commands above each role may give."""
CONTROLS = {
    "deliver": "waiter",
    "cancel": "waiter",
    "stick": "manager",
    "is-at-box": "manager",
    "tools": "manager",
    "incident-box": "manager",
    "inspect-box": "engineer",
}
"""Elements of the web UI, and the role from which on they are offered."""
OFFERED = "document.getElementById('%s').checkVisibility()"


@pytest.fixture
def site(tmp_path: Any) -> Iterator[Site]:
    served = Site(tmp_path)
    yield served
    served.close()


def test_every_command_has_a_role() -> None:
    commands = {*do.OperatorCommand.__subclasses__(), *do.MapEditCommand.__subclasses__()} - {
        do.MapEditCommand
    }
    assert set(NEEDED_ROLE) == commands


@pytest.mark.parametrize("role", ROLES)
def test_each_role_may_do_what_those_before_it_may(role: Role) -> None:
    for command, needed in NEEDED_ROLE.items():
        allowed = [may(other, needed) for other in ROLES]
        assert allowed == sorted(allowed), command
    refused = [bool(refusal_by_role(role, command)) for command in (SERVES, DRIVES, CHANGES)]
    assert refused == [number >= ALLOWED[role] for number in range(3)]


@pytest.mark.parametrize("role", ROLES)
def test_the_robot_checks_the_role_of_each_command(site: Site, role: Role) -> None:
    browser = site.browser(Visitor("anna", role))
    texts = (
        '{"do":"deliver","tables":["table_1"]}', '{"do":"drive","v":0.1,"w":0}', '{"do":"drop_box","x":1,"y":2}',
    )  # fmt: skip
    for text in texts[ALLOWED[role] :]:
        browser.send(text)
        sentence = refusal(browser)
        assert sentence == ONLY_VIEW if role == "guest" else f"a {role}" in sentence
    for text in texts[: ALLOWED[role]]:
        browser.send(text)
    wait_for(lambda: [type(one) for one in site.commands][: ALLOWED[role]] == [
        type(one) for one in (SERVES, DRIVES, CHANGES)[: ALLOWED[role]]
    ])  # fmt: skip
    browser.send('{"do":"stop","id":"a"}')
    wait_for(lambda: do.Stop("a") in site.commands)


@pytest.mark.parametrize("chooses", [True, False])
@pytest.mark.parametrize("role", ROLES)
def test_a_layer_is_sent_to_those_who_may_see_it(site: Site, role: Role, chooses: bool) -> None:
    browser = site.browser(Visitor("anna", role))
    if chooses:
        browser.send('{"do":"show","layers":["log","incidents","history","places"]}')
    site.server.set_layer("log", ())
    site.server.set_layer("incidents", IncidentsView())
    site.server.set_layer("history", ())
    site.server.set_layer("places", {"kitchen": (1.0, 2.0, 0.0)})
    received: set[str] = set()
    expected = {"log", "incidents", "history", "places"} - hidden_layers(role)
    while not expected <= received:
        received.add(json.loads(browser.recv(timeout=PATIENCE)).get("layer", ""))
    site.server.set_layer("places", {"kitchen": (1.0, 3.0, 0.0)})
    while '"y":3' not in (text := str(browser.recv(timeout=PATIENCE))).replace(" ", ""):
        received.add(json.loads(text).get("layer", ""))
    assert not received & hidden_layers(role)


def test_layers_with_a_role_exist() -> None:
    assert set(LAYER_ROLE) <= set(LAYERS)


@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize("role", ROLES)
def test_the_page_offers_what_the_role_may_do(site: Site, role: Role) -> None:
    show_a_room(site.server)
    site.server.set_layer(
        "delivery", DeliveryView(state="waiting", place="table_1", waits_for="taken", round_active=True)
    )
    with open_tab(site.server.url_for(Visitor("anna", role)), NO_GPU) as tab:
        tab.wait_for(f"document.body.dataset.role === '{role}'")
        tab.wait_for("!document.getElementById('taken').hidden")
        for element, needed in CONTROLS.items():
            assert tab.evaluate(OFFERED % element) == may(role, needed), element  # type: ignore[arg-type]
        for element in ("stop", "canvas", "step", "where", "language"):
            assert tab.evaluate(OFFERED % element), element
        row = "document.querySelector('#round .row').checkVisibility()"
        assert tab.evaluate(row) == may(role, "waiter")
        site.server.set_layer("stop", StopView(stopped=True))
        tab.wait_for("document.getElementById('stop').textContent === 'STOPPED'")
        assert tab.evaluate(OFFERED % "release-stop") == may(role, "waiter")


def test_the_link_of_a_guest_gives_no_other_role(site: Site) -> None:
    address = site.server.url_for(Visitor("anna", "guest"))
    assert httpx.get(address, follow_redirects=False).status_code == 303
    assert httpx.get(address.replace("guest", "engineer"), follow_redirects=False).status_code == 403
