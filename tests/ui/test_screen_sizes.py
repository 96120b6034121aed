"""Tests in Chromium that what a waiter needs is there on every screen: phone, on its side, laptop, zoomed."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab

from chefbot.ui.display.views import DeliveryView, LaunchView, StatusView, StopView

pytestmark = [pytest.mark.slow, needs_chromium]
SIZES = [(320, 640), (390, 844), (640, 320), (844, 390), (720, 450), (1440, 900)]
"""Widths and heights in pixels of the style sheet; 720 x 450 is a laptop's screen at a zoom of 200 %."""
WARNINGS = tuple(f"Sensor {number}: it has sent nothing for {number} s." for number in range(1, 6))
WAITS = DeliveryView(state="waiting", place="table_1", waits_for="taken", round_active=True, loaded=True)
CAN_BE_PRESSED = """((id) => {
  const button = document.getElementById(id);
  button.scrollIntoView();
  const { x, y, width, height } = button.getBoundingClientRect();
  const hit = document.elementFromPoint(x + width / 2, y + height / 2);
  return width > 40 && height > 30 && (hit === button || button.contains(hit));
})"""
AREA_OF_MAP = """(() => {
  const { width, height } = document.getElementById('canvas').getBoundingClientRect();
  return width * height / (innerWidth * innerHeight);
})()"""


@pytest.fixture
def waiting(page: Any) -> Any:
    """A robot that waits at a table, with more warnings than lines for them."""
    show_a_room(page.server)
    page.server.set_layer("delivery", WAITS)
    page.server.set_layer("status", StatusView(phase="At table 1.", warnings=WARNINGS))
    return page


def test_a_round_can_be_served_on_every_screen(waiting: Any) -> None:
    with open_tab(waiting.url, NO_GPU) as tab:
        for width, height in SIZES:
            tab.resize(width, height)
            tab.wait_for("!document.getElementById('taken').hidden")
            for button in ("taken", "not_taken", "stop", "fit", "follow"):
                assert tab.evaluate(f"{CAN_BE_PRESSED}('{button}')"), (button, width, height)
            assert tab.evaluate(AREA_OF_MAP) > 0.2, (width, height)
            assert tab.evaluate("document.documentElement.scrollWidth") == width


def test_loaded_is_in_view_above_many_tables(page: Any) -> None:
    show_a_room(page.server)
    tables = ("table_1", "table_2", "table_1", "table_2")
    step = "In the kitchen. Load the food for table 1, table 2, table 1 and table 2, then press 'Loaded'."
    loads = DeliveryView(state="loading", step=step, queue=tables, waits_for="loaded", round_active=True)
    page.server.set_layer("delivery", loads)
    hidden = """document.getElementById('loaded').getBoundingClientRect().bottom
      - document.querySelector('footer').getBoundingClientRect().top"""
    with open_tab(page.url, NO_GPU) as tab:
        for width, height in SIZES:
            tab.resize(width, height)
            tab.wait_for("document.querySelectorAll('#queue li').length === 4")
            tab.evaluate("document.getElementById('panels').scrollTop = 0")
            assert tab.evaluate(hidden) <= 0.0, (width, height)


def test_a_warning_does_not_move_the_buttons(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("delivery", WAITS)
    tops = (
        """(() => ['taken', 'stop'].map((id) => document.getElementById(id).getBoundingClientRect().top))()"""
    )
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("!document.getElementById('taken').hidden")
        for width, height in SIZES:
            tab.resize(width, height)
            before = tab.evaluate(tops)
            page.server.set_layer("status", StatusView(phase="At table 1.", warnings=WARNINGS))
            tab.wait_for("!document.getElementById('warnings').hidden")
            assert tab.evaluate(tops) == before, (width, height)
            page.server.set_layer("status", StatusView(phase="At table 1."))
            tab.wait_for("document.getElementById('warnings').hidden")


def test_a_stop_of_another_person_does_not_move_the_buttons(page: Any) -> None:
    show_a_room(page.server)
    tops = """(() => ['deliver', 'stop'].map((id) => document.getElementById(id).getBoundingClientRect().top))()"""
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("document.querySelectorAll('#tables button').length > 0")
        for width, height in SIZES:
            tab.resize(width, height)
            before = tab.evaluate(tops)
            page.server.set_layer("stop", StopView(stopped=True))
            tab.wait_for("document.getElementById('release-stop').checkVisibility()")
            assert np.abs(np.array(tab.evaluate(tops)) - before).max() <= 1.0, (width, height)
            page.server.set_layer("stop", StopView())
            tab.wait_for("!document.getElementById('release-stop').checkVisibility()")


def test_the_alarm_of_a_stop_is_on_every_screen(page: Any) -> None:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("!document.body.classList.contains('offline')")
        tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
        tab.wait_for("!document.getElementById('alarm').hidden")
        for width, height in SIZES:
            tab.resize(width, height)
            top = tab.evaluate("document.getElementById('alarm').getBoundingClientRect().top")
            assert top >= 0, (width, height)
            for button in ("release-stop", "stop"):
                assert tab.evaluate(f"{CAN_BE_PRESSED}('{button}')"), (button, width, height)
            assert tab.evaluate("document.documentElement.scrollWidth") == width


def test_a_place_of_one_word_is_not_broken_on_any_screen(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("places", {"reception": (6, 2, 0), "bar": (4, 2, 0)})
    heights = """(() => [...document.querySelectorAll('#places button')].map((button) => {
      const words = document.createRange();
      words.selectNodeContents(button);
      return words.getBoundingClientRect().height;
    }))()"""
    with open_tab(page.url, NO_GPU) as tab:
        for width, height in SIZES:
            tab.resize(width, height)
            tab.wait_for("document.querySelectorAll('#places button').length === 2")
            tab.evaluate("document.getElementById('places').scrollIntoView()")
            long, short = tab.evaluate(heights)
            assert long == short, (width, height)


def test_no_word_of_a_button_is_broken(waiting: Any) -> None:
    """German words are long. A word is broken if it is on several lines."""
    waiting.server.set_layer("delivery", msgspec.structs.replace(WAITS, choices=("kitchen",)))
    broken = r"""[...document.querySelectorAll('#round .row button')].filter((button) => button.checkVisibility())
      .flatMap((button) => [...button.textContent.matchAll(/\S+/g)].filter((word) => {
        const range = document.createRange();
        range.setStart(button.firstChild, word.index);
        range.setEnd(button.firstChild, word.index + word[0].length);
        return range.getClientRects().length > 1;
      }).map(([word]) => word))"""
    with open_tab(waiting.url, NO_GPU) as tab:
        tab.evaluate("localStorage.setItem('chefbot-language', 'de'); location.reload()")
        tab.wait_for("document.getElementById('taken')?.textContent === 'Entnommen'")
        for width, height in SIZES:
            tab.resize(width, height)
            tab.wait_for("!document.getElementById('kitchen').hidden")
            assert tab.evaluate(broken) == [], (width, height)


def test_every_layer_can_be_chosen_on_every_screen(page: Any) -> None:
    show_a_room(page.server)
    hidden = """(() => [...document.querySelectorAll('#layer-list input')].filter((box) => {
      box.scrollIntoView({ block: 'nearest' });
      const { x, y, width, height } = box.getBoundingClientRect();
      return document.elementFromPoint(x + width / 2, y + height / 2) !== box;
    }).map((box) => box.parentElement.textContent))()"""
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("document.querySelectorAll('#layer-list input').length > 10")
        tab.evaluate("document.getElementById('layers').open = true")
        for width, height in SIZES:
            tab.resize(width, height)
            assert tab.evaluate(hidden) == [], (width, height)


@pytest.mark.parametrize("stopped", [False, True])
def test_nothing_is_behind_the_stop_button_on_any_screen(page: Any, stopped: bool) -> None:
    show_a_room(page.server)
    page.server.set_layer("stop", StopView(stopped=stopped))
    hidden = """document.getElementById('panels').getBoundingClientRect().bottom
      - document.querySelector('footer').getBoundingClientRect().top"""
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"document.getElementById('release-stop').checkVisibility() === {str(stopped).lower()}")
        for width, height in SIZES:
            tab.resize(width, height)
            assert tab.evaluate(hidden) <= 0.5, (width, height)


BUTTON_SIZES = [(768, 1024), (1024, 768), *SIZES]


def test_no_button_on_the_map_covers_another(page: Any) -> None:
    show_a_room(page.server)
    overlaps = """(() => {
      const boxes = [...document.querySelectorAll('#tools button, #views > button, #layers summary')]
        .filter((button) => button.checkVisibility()).map((button) => button.getBoundingClientRect());
      return boxes.filter((a, i) => boxes.slice(0, i).some((b) =>
        a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)).length;
    })()"""
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("document.querySelectorAll('#tables button').length > 0")
        for width, height in BUTTON_SIZES:
            tab.resize(width, height)
            assert tab.evaluate(overlaps) == 0, (width, height)


def test_the_order_of_many_tables_is_served_by_a_button_in_sight(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("places", {f"table_{number}": (number, 1, 0) for number in range(1, 47)})
    with open_tab(page.url, NO_GPU) as tab:
        tab.resize(390, 844)
        tab.wait_for("document.querySelectorAll('#tables button').length === 46")
        tab.evaluate("document.querySelector('#tables button:last-child').focus()")
        tab.evaluate("document.querySelector('#tables button:last-child').click()")
        bottom = "document.querySelector('footer').getBoundingClientRect().top"
        assert tab.evaluate(f"deliver.getBoundingClientRect().bottom < {bottom}")
        assert tab.evaluate("deliver.getBoundingClientRect().top >= panels.getBoundingClientRect().top")
        assert tab.evaluate("deliver.textContent") == "Serve Table 46"
        tab.evaluate("document.querySelector('#tables button').focus()")
        first, button = "document.querySelector('#tables button')", "deliver"
        assert tab.evaluate(f"{first}.getBoundingClientRect().top >= {button}.getBoundingClientRect().bottom")


def test_a_mapper_offers_no_deliveries(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("launch", LaunchView(mapping=True))
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("document.querySelectorAll('#tables button').length > 0")
        for hidden in ("deliver", "round", "bring"):
            assert not tab.evaluate(f"document.getElementById('{hidden}').checkVisibility()")
        assert tab.evaluate("document.querySelector('#places button').checkVisibility()")
