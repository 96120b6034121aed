"""Tests that the web UI is used without a pointer: orders by Tab and Enter, goals and zones by the map's cursor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from tests.support.web_ui import MAP_SHOWN, show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.msgs.chefbot_msgs.maps import MapZones
from chefbot.ui import commands as do
from chefbot.ui.display.message_conversion import zone_views
from chefbot.ui.display.views import DeliveryView, StopView, WaitingOrderView
from chefbot.ui.map_commands import PutZone

pytestmark = [pytest.mark.slow, needs_chromium]
CODES = {",": "Comma", ".": "Period", " ": "Space", "+": "Equal", "-": "Minus"}
HINT = "document.getElementById('hint').textContent"
SHIFT = 8


@pytest.fixture
def tab(page: Any) -> Iterator[Tab]:
    show_a_room(page.server)
    page.server.set_layer("zones", zone_views(MapZones()))
    with open_tab(page.url, NO_GPU) as opened:
        opened.wait_for(f"!document.body.classList.contains('offline') && {MAP_SHOWN}")
        opened.evaluate("document.getElementById('fit').click()")
        yield opened
        assert opened.errors() == []


def key(tab: Tab, name: str, times: int = 1, modifiers: int = 0) -> None:
    text = {"Enter": "\r"}.get(name, name if len(name) == 1 else "")
    for _ in range(times):
        for kind in ("keyDown", "keyUp"):
            tab.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=name,
                code=CODES.get(name, name),
                windowsVirtualKeyCode={"Enter": 13, "Tab": 9, " ": 32}.get(name, 0),
                text=text if kind == "keyDown" else "",
                modifiers=modifiers,
            )


def tab_to(tab: Tab, element: str) -> None:
    """Press Tab until the focus is on an element, given as an expression."""
    for _ in range(80):
        if tab.evaluate(f"document.activeElement === {element}"):
            return
        key(tab, "Tab")
    raise AssertionError(f"Tab never arrives at {element}")


def choose_tool(tab: Tab, name: str) -> None:
    """Choose a tool by arrow keys, and go back to the map."""
    tab_to(tab, "document.querySelector('#tools [aria-checked=true]')")
    for _ in range(8):
        if tab.evaluate("document.activeElement.dataset.tool") == name:
            break
        key(tab, "ArrowRight")
    tab.evaluate("document.activeElement.blur()")
    tab_to(tab, "document.getElementById('canvas')")


def test_a_delivery_is_ordered_and_confirmed(page: Any, tab: Tab) -> None:
    tab_to(tab, "document.querySelector('#tables [data-name=table_2]')")
    key(tab, "Enter")
    tab_to(tab, "document.getElementById('deliver')")
    key(tab, "Enter")
    assert page.next_command() == do.Deliver(["table_2"])
    waiting = DeliveryView(state="waiting", place="table_2", waits_for="taken", round_active=True)
    page.server.set_layer("delivery", waiting)
    tab.wait_for("!document.getElementById('taken').hidden")
    tab.evaluate("document.activeElement.blur()")
    tab_to(tab, "document.getElementById('taken')")
    key(tab, "Enter")
    assert page.next_command() == do.Taken("table_2")
    # the button is gone, and the next Tab continues from the round
    page.server.set_layer("delivery", DeliveryView(state="driving", place="table_1", round_active=True))
    tab.wait_for("document.getElementById('taken').hidden")
    assert tab.evaluate("document.activeElement.id") == "round"


def test_stop_is_released_from_the_top_of_the_page(page: Any, tab: Tab) -> None:
    page.server.set_layer("stop", StopView(stopped=True, pressed="a"))
    tab.wait_for("!document.getElementById('release-stop').hidden")
    tab_to(tab, "document.querySelector('.skip[href=\"#stop-bar\"]')")
    key(tab, "Enter")
    key(tab, "Tab")
    assert tab.evaluate("document.activeElement.id") == "release-stop"


def test_a_waiting_order_is_cancelled(page: Any, tab: Tab) -> None:
    places = ("table_1", "table_2")
    orders = (WaitingOrderView(id="b", places=places), WaitingOrderView(id="", places=places))
    view = DeliveryView(state="driving", place="table_1", round_active=True, orders=orders)
    page.server.set_layer("delivery", view)
    tab.wait_for("document.querySelectorAll('#orders li').length === 2")
    assert tab.evaluate("document.querySelector('#orders li').innerText.startsWith('Then: Table 1, Table 2')")
    assert tab.evaluate("document.querySelectorAll('#orders button')[1].hidden"), "it has no id"
    tab_to(tab, "document.querySelector('#orders button')")
    assert tab.evaluate("document.activeElement.ariaLabel") == "Cancel the order: Table 1, Table 2"
    key(tab, "Enter")
    assert tab.evaluate("document.activeElement.ariaLabel").endswith("Cancel it?") and page.commands.empty()
    tab.evaluate("new Promise((done) => setTimeout(done, 450))")
    key(tab, "Enter")
    assert page.next_command() == do.ChangeQueue([], "b")


def test_all_orders_are_cancelled_after_a_question(page: Any, tab: Tab) -> None:
    """A status that arrives meanwhile does not take the question away."""
    view = DeliveryView(state="driving", place="table_1", round_active=True)
    page.server.set_layer("delivery", view)
    tab.wait_for("document.getElementById('cancel').textContent === 'Cancel the round and all orders'")
    tab_to(tab, "document.getElementById('cancel')")
    key(tab, "Enter")
    page.server.set_layer("delivery", msgspec.structs.replace(view, queue=("table_2",)))
    tab.wait_for("document.querySelectorAll('#queue li').length === 1")
    assert (
        tab.evaluate("document.activeElement.textContent") == "Cancel everything?" and page.commands.empty()
    )
    tab.evaluate("new Promise((done) => setTimeout(done, 450))")
    key(tab, "Enter")
    assert page.next_command() == do.Cancel()
    page.server.set_layer("delivery", DeliveryView())
    tab.wait_for("document.getElementById('cancel').textContent === 'Cancel the current task'")
    key(tab, "Enter")
    assert page.next_command() == do.Cancel(), "a single goal is cancelled at once"


def test_a_goal_is_set_by_the_cursor_of_the_map(page: Any, tab: Tab) -> None:
    choose_tool(tab, "goal")
    tab.wait_for(f"{HINT}.startsWith('Keys: arrows move')")
    key(tab, "ArrowRight", 2)
    key(tab, "ArrowUp", modifiers=SHIFT)
    key(tab, ",", 6)
    scale = tab.evaluate("parseFloat(document.getElementById('hint').textContent.slice(2))")
    assert "direction 90°" in tab.evaluate(HINT) and "m from Table" in tab.evaluate(HINT)
    key(tab, "Enter")
    goal = page.next_command()
    assert isinstance(goal, do.Goal)
    step = (goal.x - 1.0) / 2.0
    assert goal.x == pytest.approx(scale, abs=0.01) and step > 0.1
    assert goal.y == pytest.approx(1.0 + 5 * step, abs=0.01) and goal.yaw == pytest.approx(
        math.pi / 2, abs=0.02
    )
    assert tab.evaluate("document.querySelector('#tools [aria-checked=true]').dataset.tool") == "look"


def test_arrows_without_a_tool_move_the_view(page: Any, tab: Tab) -> None:
    tab_to(tab, "document.getElementById('canvas')")
    for name in ("ArrowLeft", "ArrowDown", "+", "-", "Home", ",", "Enter"):
        key(tab, name)
    assert page.commands.empty()


def test_a_distance_is_measured(tab: Tab) -> None:
    choose_tool(tab, "measure")
    key(tab, "ArrowRight")
    key(tab, "Enter")
    key(tab, "ArrowRight", 3)
    tab.wait_for(f"{HINT}.endsWith('m from the first point')")
    moved = float(tab.evaluate(HINT).rpartition("; ")[2].split()[0])
    assert moved > 0.2
    key(tab, "Enter")
    tab.evaluate("document.activeElement.blur()")


def test_a_zone_is_drawn_corner_by_corner(page: Any, tab: Tab) -> None:
    tab.evaluate("document.getElementById('edit-tab').click()")
    tab.evaluate("document.getElementById('edit-box').open = true")
    tab.evaluate("document.getElementById('zone-new').click()")
    tab.evaluate("document.activeElement.blur()")
    tab_to(tab, "document.getElementById('canvas')")
    for name in ("ArrowRight", "ArrowUp", "ArrowLeft"):
        key(tab, name, modifiers=SHIFT)
        key(tab, "Enter")
    while True:
        command = page.next_command()
        if isinstance(command, PutZone) and len(command.corners) == 3:
            break
    (ax, ay), (bx, by), (cx, cy) = command.corners
    assert bx == pytest.approx(ax) and by > ay and cy == pytest.approx(by) and cx < bx


def test_a_place_is_added_without_a_walk(page: Any, tab: Tab) -> None:
    """Its button leads to the map, and a press there to the form."""
    tab.evaluate("document.getElementById('edit-tab').click()")
    tab.evaluate("document.getElementById('edit-box').open = true")
    tab.evaluate("document.getElementById('place-new').focus()")
    key(tab, "Enter")
    assert tab.evaluate("document.activeElement.id") == "canvas"
    key(tab, "ArrowRight")
    key(tab, "Enter")
    assert tab.evaluate("document.activeElement.id") == "place-label"
    tab.evaluate("document.getElementById('place-cancel').click()")


def test_the_manual_is_opened_read_and_closed(tab: Tab) -> None:
    tab_to(tab, "document.getElementById('manual-open')")
    key(tab, "Enter")
    assert tab.evaluate("document.getElementById('manual').checkVisibility()")
    assert tab.evaluate("document.activeElement.id") == "manual-close"
    assert tab.evaluate("document.querySelectorAll('#manual h2').length") == 5
    key(tab, "Enter")
    assert tab.evaluate("document.activeElement.id") == "manual-open"
    assert tab.evaluate("document.getElementById('manual').hidden")
