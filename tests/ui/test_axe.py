"""Axe-core finds no fault of accessibility in any state of the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.ros2.tools.inspection_views import LogLine
from chefbot.ui.display.views import DeliveryView, StatusView, StopView

REPOSITORY = Path(__file__).parents[2]
AXE = REPOSITORY / "build" / "node_modules" / "axe-core" / "axe.min.js"
pytestmark = [
    pytest.mark.slow,
    needs_chromium,
    pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed (make axe)"),
]
FAULTS = """axe.run().then(({ violations }) =>
  violations.map(({ id, nodes }) => [id, ...nodes.map(({ html }) => html.slice(0, 120))]))"""
OPEN_ALL = "document.querySelectorAll('details').forEach((one) => { one.open = true; })"
PANELS = """[...document.querySelectorAll('[data-tab]')].filter((one) => one.checkVisibility())
  .map((one) => one.dataset.tab)"""
PHONE, LAPTOP, ON_ITS_SIDE = (390, 844), (1440, 900), (844, 390)
WAITS = DeliveryView(state="waiting", place="table_1", waits_for="taken", round_active=True, loaded=True)


@pytest.fixture
def busy(page: Any) -> Any:
    """A robot that waits at a table in the middle of a round, with a warning and a log longer than its box."""
    show_a_room(page.server)
    page.server.set_layer("delivery", WAITS)
    page.server.set_layer("status", StatusView(phase="At table 1.", warnings=("The battery is low.",)))
    page.server.set_layer("log", tuple(LogLine(float(i), 30, "slam", f"line {i}") for i in range(100)))
    return page


@pytest.fixture
def tab(busy: Any) -> Iterator[Tab]:
    with open_tab(busy.url, NO_GPU) as opened:
        opened.wait_for("!document.getElementById('taken').hidden")
        yield opened


def faults(tab: Tab) -> list[list[str]]:
    if not tab.evaluate("'axe' in window"):
        tab.evaluate(AXE.read_text() + ";0")
    found: list[list[str]] = tab.evaluate(FAULTS)
    return found


def set_scheme(tab: Tab, scheme: str) -> None:
    tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])


def test_axe_finds_what_is_wrong(tab: Tab) -> None:
    tab.evaluate("document.getElementById('stop').parentElement.append(new Image())")
    assert [fault[0] for fault in faults(tab)] == ["image-alt"]


@pytest.mark.parametrize("size", [PHONE, LAPTOP, ON_ITS_SIDE])
def test_everything_open_has_no_fault(tab: Tab, size: tuple[int, int]) -> None:
    """A phone shows one panel at a time, a laptop all of them."""
    tab.resize(*size)
    tab.evaluate(OPEN_ALL)
    for panel in tab.evaluate(PANELS) or ["all"]:
        tab.evaluate(f"document.querySelector('[data-tab={panel}]')?.click()")
        if panel in ("inspect", "all"):
            tab.wait_for("document.querySelectorAll('#log-list li').length === 100")
        for scheme in ("light", "dark"):
            set_scheme(tab, scheme)
            assert faults(tab) == [], (panel, scheme)


def test_the_alarm_of_a_stop_has_no_fault(tab: Tab) -> None:
    tab.resize(*PHONE)
    tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
    tab.wait_for("!document.getElementById('alarm').hidden")
    assert faults(tab) == []


@pytest.mark.parametrize("stopped", [False, True])
def test_the_robots_screen_has_no_fault(busy: Any, stopped: bool) -> None:
    busy.server.set_layer("stop", StopView(stopped=stopped))
    with open_tab(f"{busy.url}#kiosk", NO_GPU) as tab:
        tab.wait_for(
            f"document.getElementById('kiosk-title').textContent.includes('{'Stop' if stopped else 'food'}')"
        )
        assert faults(tab) == []
