"""Tests in Chromium that the web UI calls a person by sound, vibration and notification, only where chosen."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.ui.display.views import DeliveryView, StatusView

pytestmark = [pytest.mark.slow, needs_chromium]
LISTEN = """
  window.given = [];
  AudioContext.prototype.createOscillator = new Proxy(AudioContext.prototype.createOscillator, {
    apply(call, context, values) { window.given.push("tone"); return Reflect.apply(call, context, values); },
  });
  Object.defineProperty(navigator, "vibrate", { value: () => window.given.push("vibration") });
"""
"""Notes the calls to the browser, of which a computer without loudspeaker shows nothing."""
ALERT = ["tone", "tone", "vibration"]


@pytest.fixture
def tab(page: Any) -> Iterator[Tab]:
    show_a_room(page.server)
    page.server.set_layer("delivery", waits_at("kitchen", "loaded"))
    with open_tab("about:blank", NO_GPU) as opened:
        opened.call("Page.addScriptToEvaluateOnNewDocument", source=LISTEN)
        opened.call("Page.navigate", url=page.url)
        opened.wait_for("document.getElementById('loaded')?.hidden === false")
        yield opened


def waits_at(place: str, confirmation: str) -> DeliveryView:
    state = {"loaded": "loading", "taken": "waiting"}[confirmation]
    return DeliveryView(state=state, place=place, waits_for=confirmation, round_active=True)


def given_after(tab: Tab, shown: str) -> list[str]:
    """Return the calls to the browser until a condition holds."""
    tab.wait_for(shown)
    given: list[str] = tab.evaluate("window.given.splice(0)")
    return given


def test_the_page_calls_for_what_is_new_and_only_if_chosen(page: Any, tab: Tab) -> None:
    page.server.set_layer("delivery", waits_at("table_1", "taken"))
    assert given_after(tab, "!document.getElementById('taken').hidden") == [], "not chosen"
    tab.evaluate("document.getElementById('alerts').scrollIntoView()")
    tab.click("#alerts")
    assert given_after(tab, "window.given.length > 0") == ["tone", "tone"], "how it sounds"
    page.server.set_layer("delivery", waits_at("table_2", "taken"))
    assert given_after(tab, "window.given.length > 2") == ALERT
    page.server.set_layer("delivery", DeliveryView(state="returning", place="home", round_active=True))
    assert given_after(tab, "document.getElementById('taken').hidden") == []
    page.server.set_layer("status", StatusView(battery=20.0, failures=0))
    tab.wait_for("document.getElementById('battery').textContent === '20 %'")
    page.server.set_layer("status", StatusView(battery=19.0, failures=0))
    assert given_after(tab, "window.given.length > 1") == ["tone", "vibration"], "worth knowing"
    page.server.set_layer("status", StatusView(battery=19.0, failures=1, reason="A door is closed."))
    assert given_after(tab, "window.given.length > 4") == ["tone"] * 4 + ["vibration"]
    assert tab.evaluate("document.getElementById('notice').ariaLive") == "assertive"
    untaken = DeliveryView(state="idle", unserved=("table_2",), step="Nobody took the food.")
    page.server.set_layer("delivery", untaken)
    assert given_after(tab, "window.given.length > 2") == ALERT, "a round that ends with food on the tray"
    assert tab.errors() == []


def test_the_choice_outlives_the_page_and_old_news_is_not_given(page: Any, tab: Tab) -> None:
    tab.evaluate("document.getElementById('alerts').scrollIntoView()")
    tab.click("#alerts")
    tab.call("Page.reload")
    tab.wait_for("document.getElementById('loaded')?.hidden === false")
    assert tab.evaluate("document.getElementById('alerts').checked") and tab.evaluate("window.given") == []
