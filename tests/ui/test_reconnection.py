"""Tests in Chromium what the web UI reports after a lost connection: about the last command, and about a restart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from tests.support.waiting import wait_for
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab
from tests.ui.faulty_network import FaultyNetwork

from chefbot.storage.delivery_history import RecordedRound, RecordedStop
from chefbot.ui.commands import Cancel, Deliver
from chefbot.ui.display.views import DeliveryView, WaitingOrderView
from chefbot.ui.server import WebUiServer

pytestmark = [pytest.mark.slow, needs_chromium]
NOTICE = "document.getElementById('notice').textContent"
RECORD_NOTICES = """
window.notices = [];
const notice = document.getElementById("notice");
new MutationObserver(() => window.notices.push(notice.textContent)).observe(
    notice, { childList: true, characterData: true, subtree: true });
"""
ROUND = "document.getElementById('step').textContent"
OFFLINE = "document.body.classList.contains('offline')"


@pytest.fixture
def network(page: Any) -> Iterator[FaultyNetwork]:
    between = FaultyNetwork(urlsplit(page.url).port or 0)
    yield between
    between.close()


@pytest.fixture
def tab(page: Any, network: FaultyNetwork) -> Iterator[Tab]:
    show_a_room(page.server)
    with open_tab(f"http://127.0.0.1:{network.port}/", NO_GPU) as opened:
        opened.wait_for("document.querySelectorAll('#tables button').length === 2")
        opened.evaluate("window.page = true")  # gone after a reload
        yield opened


def press_cancel_while(
    tab: Tab, network: FaultyNetwork, mode: str, arrived: Callable[[], Any] = list
) -> None:
    """Press Cancel on a link with a fault, and let the link recover once the web UI has noticed it.

    arrived: waits until the robot's computer has received the command, if it does.
    """
    network.mode = mode
    tab.evaluate("document.getElementById('cancel').click()")
    tab.wait_for(OFFLINE)
    assert "before the robot confirmed" in tab.evaluate(NOTICE)
    arrived()
    network.mode = "pass"
    tab.wait_for(f"!{OFFLINE}")


def test_a_command_that_arrived_is_not_reported_as_doubtful(
    page: Any, network: FaultyNetwork, tab: Tab
) -> None:
    commands: list[Any] = []
    tab.evaluate(RECORD_NOTICES)  # another reconnection, as of a busy computer, takes a notice away
    press_cancel_while(tab, network, "answers lost", lambda: commands.append(page.next_command()))
    assert commands == [Cancel()]
    tab.wait_for("window.notices.some((text) => text.includes('received the last command'))")
    assert page.commands.empty() and tab.evaluate("window.page")


def test_an_order_that_arrived_is_not_offered_again(page: Any, network: FaultyNetwork, tab: Tab) -> None:
    tab.evaluate("document.querySelector('#tables button').click()")
    network.mode = "answers lost"
    tab.evaluate("document.getElementById('deliver').click()")
    assert page.next_command() == Deliver(["table_1"])
    tab.wait_for(OFFLINE)
    assert not tab.evaluate("document.getElementById('deliver').disabled"), "it may be lost"
    network.mode = "pass"
    tab.wait_for(f"!{OFFLINE} && document.getElementById('deliver').disabled")


def test_a_command_that_was_lost_stays_reported(page: Any, network: FaultyNetwork, tab: Tab) -> None:
    press_cancel_while(tab, network, "hole")
    tab.evaluate("document.querySelector('#tables button').click()")
    tab.evaluate("document.getElementById('deliver').click()")
    assert page.next_command() == Deliver(["table_1"])
    assert "before the robot confirmed" in tab.evaluate(NOTICE)


def test_two_restarts_in_a_row_lose_no_report(page: Any, network: FaultyNetwork, tab: Tab) -> None:
    page.server.set_layer(
        "delivery", DeliveryView(state="driving", place="table_1", loaded=True, round_active=True)
    )
    tab.wait_for("!document.getElementById('cancel').hidden")
    servers = [WebUiServer(0, "127.0.0.1", lambda command, _: page.commands.put(command)) for _ in range(2)]
    try:
        for number, server in enumerate(servers):
            if number:
                server.set_layer("delivery", DeliveryView(step="Waiting for an order.", state="idle"))
            network.target = urlsplit(server.start()).port or 0
            network.reset()
            wait_for(lambda server=server: server.clients > 0)
        tab.wait_for(f"{NOTICE} === 'chefbot was restarted and lost the round. Not served: Table 1.'")
        stops = (RecordedStop("table_1", "", None),)
        rounds = (RecordedRound("anna", False, "2026-11-27T12:00:00+00:00", None, None, "", stops),)
        servers[1].set_layer("history", rounds)
        tab.wait_for("document.querySelector('#history button')?.textContent === 'Order Table 1 again'")
        servers[1].set_layer("delivery", DeliveryView(state="loading", round_active=True))
        tab.wait_for("!document.querySelector('#history button')")
    finally:
        for server in servers:
            server.stop()


@pytest.mark.parametrize("has_the_round", [False, True])
def test_a_restart_is_reported_with_the_tables_not_served(
    page: Any, network: FaultyNetwork, tab: Tab, has_the_round: bool
) -> None:
    """If only the web UI's process was restarted, the robot goes on with the round."""
    on_the_way = DeliveryView(
        state="driving",
        place="table_1",
        step="On the way.",
        loaded=True,
        round_active=True,
        orders=(WaitingOrderView(id="b", places=("table_2",)),),
    )
    page.server.set_layer("delivery", on_the_way)
    tab.wait_for("document.getElementById('orders').textContent.includes('Table 2')")
    restarted = WebUiServer(0, "127.0.0.1", lambda command, _: page.commands.put(command))
    after = on_the_way if has_the_round else DeliveryView(step="Waiting for an order.", state="idle")
    restarted.set_layer("delivery", after)
    network.target = urlsplit(restarted.start()).port or 0
    network.reset()
    try:
        lost = "chefbot was restarted and lost the round. Not served: Table 1, Table 2."
        tab.wait_for(
            f"document.querySelectorAll('#tables button').length === 0 && {ROUND} === '{after.step}'"
        )
        tab.wait_for(f"{NOTICE} === '{'' if has_the_round else lost}'")
        assert tab.evaluate("window.page")
    finally:
        restarted.stop()
    page_errors = [error for error in tab.errors() if "WebSocket" not in str(error)]
    assert page_errors == []
