"""Tests in Chromium that a new page shows the whole map, and the effect of keys."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.delivery.status_messages import QUEUE_CHANGED
from chefbot.storage.delivery_history import RecordedRound, RecordedStop
from chefbot.ui.commands import ChangeQueue, Deliver, Drive, Follow, GoPlace
from chefbot.ui.display.views import DeliveryView, RoundStopView, StatusView, WaitingOrderView

pytestmark = [pytest.mark.slow, needs_chromium]
LOADS = 5
NOON = "2026-11-27T12:00:00+00:00"
LATE_RESIZE = """window.ResizeObserver = class {
  constructor(resized) { this.resized = resized; }
  observe() { setTimeout(this.resized, 700); }
};"""
"""A browser that reports the size of the canvas after the map has arrived, as happens on a busy phone."""
DRAWN_AREA = """(() => {
  const canvas = document.getElementById('canvas'), { width, height } = canvas;
  const data = canvas.getContext('2d').getImageData(0, 0, width, height).data;
  let [left, right, top, bottom] = [width, -1, height, -1];
  for (let i = 3; i < data.length; i += 4) {
    if (!data[i]) continue;
    const x = (i >> 2) % width, y = Math.floor((i >> 2) / width);
    left = Math.min(left, x); right = Math.max(right, x); top = Math.min(top, y); bottom = Math.max(bottom, y);
  }
  return JSON.stringify([left / width, right / width, top / height, bottom / height]);
})()"""
"""Bounds of the drawn area as fractions of the canvas, including the scale bar."""


NARROWEST_BUTTON = (
    "Math.min(...[...document.querySelectorAll('.chips button')].map((one) => one.offsetWidth))"
)
LATER = "new Promise((done) => setTimeout(() => done({}), 450))"
"""A tap that is not the second one of a double tap."""
FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""A promise that is fulfilled when the page has been drawn."""


@pytest.fixture
def tab(page: Any) -> Iterator[Tab]:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as opened:
        yield opened


def area_of_whole_map(tab: Tab) -> str:
    """Return the drawn area after a click on "Whole map" and check its margin."""
    tab.evaluate(f"document.getElementById('fit').click(), {FRAMES}")
    drawn: str = tab.evaluate(DRAWN_AREA)
    left, right, top, bottom = json.loads(drawn)
    assert left > 0.001 and right < 0.999 and top > 0.001 and bottom < 0.999
    return drawn


@pytest.mark.rotated
@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
def test_the_full_map_is_shown_at_the_first_load(tab: Tab, width: int, height: int, late: bool) -> None:
    if late:
        tab.call("Page.addScriptToEvaluateOnNewDocument", source=LATE_RESIZE)
    tab.call(
        "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
    )
    tab.wait_for("document.querySelectorAll('#tables button').length === 2")
    tab.wait_for("document.getElementById('canvas').width > 300")
    expected = area_of_whole_map(tab)
    for _ in range(LOADS):
        tab.call("Page.reload")
        tab.wait_for(
            f"document.querySelectorAll('#tables button').length === 2 && {DRAWN_AREA} === '{expected}'"
        )
        assert tab.evaluate("document.getElementById('follow').getAttribute('aria-pressed')") == "false"


RECORD_PAINTS = f"""window.painted = [];
const clear = CanvasRenderingContext2D.prototype.clearRect, inflate = Response.prototype.arrayBuffer;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {{
  if (this.canvas.id === 'canvas') queueMicrotask(() => painted.push({DRAWN_AREA}));
  return clear.apply(this, box);
}};
Response.prototype.arrayBuffer = async function () {{
  await new Promise((done) => setTimeout(done, 300));
  return inflate.call(this);
}};"""
"""Keeps the drawn area of every paint; a map needs 0.3 s to decode, as a large one on a phone."""


def painted_areas(tab: Tab) -> list[str]:
    """Return the areas that were drawn one after the other since the page was loaded, without empty ones."""
    return [area for area in tab.evaluate("painted") if json.loads(area)[1] >= 0.0]


def test_nothing_is_drawn_before_the_map_has_arrived(tab: Tab) -> None:
    tab.wait_for("document.querySelectorAll('#tables button').length === 2")
    expected = area_of_whole_map(tab)
    tab.call("Page.addScriptToEvaluateOnNewDocument", source=RECORD_PAINTS)
    tab.call("Page.reload")
    tab.wait_for(f"document.querySelectorAll('#tables button').length === 2 && {DRAWN_AREA} === '{expected}'")
    assert painted_areas(tab)[0] == expected


def test_a_robot_without_a_map_is_drawn_at_once(page: Any, tab: Tab) -> None:
    page.server.set_layer("map", None)
    tab.call("Page.addScriptToEvaluateOnNewDocument", source="window.setTimeout = () => 0;")
    tab.call("Page.reload")
    tab.wait_for(
        f"document.querySelectorAll('#tables button').length === 2 && JSON.parse({DRAWN_AREA})[1] > 0"
    )


@pytest.mark.rotated
@pytest.mark.parametrize("name", ["app.js", "view.js", "style.css"])
def test_a_page_of_which_a_file_did_not_arrive_is_loaded_again(tab: Tab, name: str) -> None:
    """As when a phone changes networks meanwhile: Chromium fails what is under way with ERR_NETWORK_CHANGED."""
    tab.call("Network.setCacheDisabled", cacheDisabled=True)
    tab.call("Network.setBlockedURLs", urls=[f"*/{name}"])
    tab.call("Page.reload")
    tab.wait_for("document.readyState === 'complete'")
    # From now on the page may load itself again at any time: no script is run in it meanwhile.
    before = len(tab.events)
    tab.call("Network.setBlockedURLs", urls=[])
    tab.wait_for_event("Page.loadEventFired", tab.wait_for_event("Page.frameNavigated", before))
    tab.wait_for("document.querySelectorAll('#tables button').length === 2")
    assert tab.evaluate("getComputedStyle(document.body).margin") == "0px", "with the style sheet"


def show_warning(page: Any, tab: Tab, sentences: int = 12) -> None:
    """Show a warning above the map, and wait until the map below it is drawn."""
    height = tab.evaluate("document.getElementById('canvas').height")
    page.server.set_layer("status", StatusView(warnings=("The battery is low. " * sentences,)))
    tab.wait_for(f"document.getElementById('canvas').height < {height}")
    tab.evaluate(FRAMES)


def place_on_screen(tab: Tab) -> tuple[float, float]:
    """Return the right and top edges of what is drawn in the window, pixels."""
    box = "document.getElementById('canvas').getBoundingClientRect()"
    left, top, width, height = tab.evaluate(f"(({{ x, y, width, height }}) => [x, y, width, height])({box})")
    _, right_fraction, top_fraction, _ = json.loads(tab.evaluate(DRAWN_AREA))
    return left + right_fraction * width, top + top_fraction * height


@pytest.mark.parametrize("follows", [False, True])
def test_a_warning_does_not_move_the_map_under_a_finger(page: Any, tab: Tab, follows: bool) -> None:
    tab.wait_for(f"JSON.parse({DRAWN_AREA})[1] >= 0")
    if follows:  # a robot that stands, on a map that is in sight as a whole
        tab.evaluate(
            "document.getElementById('canvas').dispatchEvent(new WheelEvent('wheel', {deltaY: 700}))"
        )
        tab.evaluate("document.getElementById('follow').click()")
    tab.evaluate(FRAMES)
    before = place_on_screen(tab)
    show_warning(page, tab)
    assert place_on_screen(tab) == pytest.approx(before, abs=1.5)
    page.server.set_layer("status", StatusView())
    tab.wait_for("document.getElementById('warnings').hidden")
    tab.evaluate(FRAMES)
    assert place_on_screen(tab) == pytest.approx(before, abs=1.5)


def test_the_full_map_stays_visible_below_a_warning(page: Any, tab: Tab) -> None:
    tab.call("Emulation.setDeviceMetricsOverride", width=1440, height=500, deviceScaleFactor=1, mobile=False)
    tab.wait_for(f"JSON.parse({DRAWN_AREA})[1] >= 0 && document.getElementById('canvas').width > 1000")
    tab.evaluate(FRAMES)
    before = place_on_screen(tab)
    show_warning(page, tab, 36)
    drawn = tab.evaluate(DRAWN_AREA)
    assert area_of_whole_map(tab) == drawn
    assert place_on_screen(tab) != pytest.approx(before, abs=1.5), "it is smaller"
    page.server.set_layer("status", StatusView())
    tab.wait_for("document.getElementById('warnings').hidden")
    tab.evaluate(FRAMES)
    drawn = tab.evaluate(DRAWN_AREA)
    assert area_of_whole_map(tab) == drawn, "it is as large as before again"
    assert place_on_screen(tab) == pytest.approx(before, abs=1.5)


def key(tab: Tab, name: str) -> None:
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=name, code=name)


def test_arrow_keys_drive_on_the_joystick_and_select_elsewhere(page: Any, tab: Tab) -> None:
    tab.wait_for("document.querySelectorAll('#tables button').length === 2")
    tab.evaluate("document.querySelector('[data-tool=look]').focus()")
    key(tab, "ArrowRight")
    assert tab.evaluate("document.activeElement.dataset.tool") == "goal"
    assert tab.evaluate("document.activeElement.getAttribute('aria-checked')") == "true"
    tab.evaluate("document.getElementById('limit').focus()")
    key(tab, "ArrowRight")
    assert tab.evaluate("document.getElementById('limit').value") == "60"
    for element in ("cancel", "canvas", "follow"):
        tab.evaluate(f"document.getElementById('{element}').focus()")
        for name in ("ArrowDown", "ArrowRight", "i", "l"):
            key(tab, name)
    assert page.commands.empty(), "none of the keys drove"
    tab.evaluate("document.getElementById('stick').focus()")
    assert tab.evaluate("getComputedStyle(document.getElementById('stick')).outlineStyle") == "solid"
    tab.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowUp", code="ArrowUp")
    command = page.next_command()
    assert isinstance(command, Drive) and command.v > 0
    tab.evaluate("document.getElementById('cancel').focus()")
    while command != Drive(0.0, 0.0):
        command = page.next_command()


ROBOT_AT = """(() => {
  const { width, height } = canvas, data = canvas.getContext('2d').getImageData(0, 0, width, height).data;
  let [x, y, count] = [0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] !== 29 || data[i + 1] !== 37 || data[i + 2] !== 34) continue;
    x += (i >> 2) % width; y += Math.floor((i >> 2) / width); count++;
  }
  return JSON.stringify([x / count, y / count]);
})()"""
"""Where the pixels in the colour of the robot are."""


def test_zooming_while_following_does_not_move_the_robot(tab: Tab) -> None:
    tab.wait_for("document.querySelectorAll('#tables button').length === 2")
    area_of_whole_map(tab)
    before = json.loads(tab.evaluate(ROBOT_AT))
    tab.evaluate(f"document.getElementById('follow').click(), {FRAMES}")
    wheel = "new WheelEvent('wheel', { deltaY: -300, clientX: 100, clientY: 200, cancelable: true })"
    tab.evaluate(f"canvas.dispatchEvent({wheel}), {FRAMES}")
    tab.evaluate(f"document.getElementById('follow').click(), {FRAMES}")
    area_of_whole_map(tab)
    assert json.loads(tab.evaluate(ROBOT_AT)) == pytest.approx(before, abs=1.0)


def test_follow_me_is_a_button_of_its_own(page: Any, tab: Tab) -> None:
    tab.wait_for("document.querySelectorAll('#tables button').length === 2")
    tab.evaluate("document.getElementById('follow_me').click()")
    assert page.next_command() == Follow()
    ids = json.loads(
        tab.evaluate("JSON.stringify([...document.querySelectorAll('[id]')].map((one) => one.id))")
    )
    assert len(ids) == len(set(ids))


def test_a_round_is_changed_by_its_chips(page: Any, tab: Tab) -> None:
    queue = ("table_1", "table_2", "table_1")
    page.server.set_layer(
        "delivery", DeliveryView(state="driving", round_active=True, queue=queue, order_id="a")
    )
    tab.wait_for("document.querySelectorAll('#queue li').length === 3")
    assert tab.evaluate("document.querySelector('#queue button').disabled"), "the first cannot be earlier"
    assert tab.evaluate(NARROWEST_BUTTON) >= 32, "a finger is wider than a mouse"
    press = "document.querySelectorAll('#queue li')[{}].querySelectorAll('button')[{}].click()"
    tab.evaluate(press.format(1, 0))
    assert page.next_command() == ChangeQueue(["table_2", "table_1", "table_1"], "a", list(queue))
    leave_out = "document.querySelectorAll('#queue li')[2].querySelector('button:last-child')"
    tab.evaluate(f"{leave_out}.click(), {leave_out}.click()")
    assert page.commands.empty(), "a double tap does not take the food away"
    assert tab.evaluate(f"{leave_out}.textContent + '|' + {leave_out}.ariaLabel") == (
        "Leave out?|Leave out Table 1. Leave out?"
    )
    tab.evaluate(LATER.format(f"{leave_out}.click(), {leave_out}.click()"))
    assert page.next_command() == ChangeQueue(["table_1", "table_2"], "a", list(queue))
    tab.wait_for(f"{leave_out}.textContent === '×'")
    assert page.commands.empty(), "the order is changed once"
    page.server.set_layer("delivery", DeliveryView(state="returning", round_active=True))
    tab.wait_for("document.querySelectorAll('#queue li').length === 0")


def test_a_renamed_table_is_renamed_in_the_round(page: Any, tab: Tab) -> None:
    orders = (WaitingOrderView(id="b", places=("table_1",)),)
    page.server.set_layer(
        "delivery", DeliveryView(state="driving", round_active=True, queue=("table_1",), orders=orders)
    )
    shown = "document.querySelector('#queue span').textContent + document.querySelector('#orders span').textContent"
    tab.wait_for("document.querySelectorAll('#queue li, #orders li').length === 2")
    assert tab.evaluate(shown) == "Table 1Then: Table 1"
    page.server.set_layer("labels", {"table_1": "Window"})
    tab.wait_for(f"{shown} === 'WindowThen: Window'")


def test_the_focus_stays_in_the_queue_when_a_table_is_left_out(page: Any, tab: Tab) -> None:
    def show(*queue: str) -> None:
        page.server.set_layer("delivery", DeliveryView(state="driving", round_active=True, queue=queue))
        tab.wait_for(f"document.querySelectorAll('#queue li').length === {len(queue)}")

    show("table_1", "table_2", "table_1")
    tab.evaluate("document.querySelectorAll('#queue li')[1].querySelector('button:last-child').focus()")
    show("table_1", "table_1")
    assert tab.evaluate(
        "document.activeElement === document.querySelectorAll('#queue li')[1].querySelector('button:last-child')"
    )
    show()
    assert tab.evaluate("document.activeElement.id") == "round"


def test_a_long_label_leaves_the_buttons_of_a_table_in_view(page: Any, tab: Tab) -> None:
    tab.resize(390, 844)
    page.server.set_layer("labels", {"table_1": "The table below the large window on the left"})
    page.server.set_layer(
        "delivery", DeliveryView(state="driving", round_active=True, queue=("table_1", "table_1"))
    )
    tab.wait_for("document.querySelectorAll('#queue li').length === 2")
    stop = RoundStopView(place="table_1", distance=112.0, time=340, battery=81.0, reachable=True)
    page.server.set_layer("forecast", (stop, stop))
    tab.wait_for("document.querySelector('#queue small').textContent === '112 m · 6 min · 81 %'")
    assert (
        tab.evaluate(
            "(({ scrollWidth, clientWidth }) => scrollWidth - clientWidth)(document.querySelector('#queue small'))"
        )
        <= 0
    )
    assert tab.evaluate("document.querySelector('#queue li').lastChild.getBoundingClientRect().right") < 390.0
    assert tab.evaluate("document.getElementById('round').scrollWidth") <= 390
    page.server.set_layer("labels", {})
    tab.wait_for("document.querySelector('#queue span').textContent === 'Table 1'")
    tab.resize(320, 640)
    tops = "[...document.querySelector('#queue li').querySelectorAll('button')].map((one) => one.offsetTop)"
    earlier, leave = tab.evaluate(tops)
    assert earlier == leave, "the buttons stay together on the narrowest phone"


def test_missed_tables_are_ordered_again_by_one_tap(page: Any, tab: Tab) -> None:
    taken, missed = RecordedStop("table_1", "taken", NOON), RecordedStop("table_2", "<i>no path</i>", NOON)
    rounds = (RecordedRound("anna", False, NOON, NOON, NOON, "", (taken, missed)),)
    page.server.set_layer("history", rounds)
    page.server.set_layer("delivery", DeliveryView(state="failed", step="Failed.", unserved=("table_2",)))
    tab.wait_for("!document.getElementById('again').hidden")
    assert tab.evaluate("document.getElementById('again').textContent") == "Order Table 2 again"
    tab.evaluate("document.getElementById('again').click()")
    assert page.next_command() == Deliver(["table_2"])
    listed = tab.evaluate("document.getElementById('history').textContent")
    assert listed.endswith(", anna: Table 1: taken; Table 2: <i>no path</i> Order Table 2 again")
    tab.evaluate("document.querySelector('#history button').click()")
    assert page.next_command() == Deliver(["table_2"])
    tab.wait_for("!document.querySelector('#history button')")
    page.server.set_layer("delivery", DeliveryView(state="loading", round_active=True))
    tab.wait_for("document.getElementById('again').hidden")


def test_what_the_deliveries_refuse_is_shown_and_can_be_closed(page: Any, tab: Tab) -> None:
    shown = "!document.getElementById('notice').hidden && document.getElementById('notice').textContent"
    page.server.set_layer("status", StatusView(phase="Ready."))
    tab.wait_for("document.getElementById('phase').textContent === 'Ready.'")
    page.server.set_layer("status", StatusView(phase="Ready.", notice=QUEUE_CHANGED, notices=1))
    tab.wait_for(f"{shown} === '{QUEUE_CHANGED}'")
    tab.evaluate("document.getElementById('notice-close').click()")
    assert tab.evaluate("document.getElementById('notice').hidden")
    page.server.set_layer("status", StatusView(phase="Later.", notice=QUEUE_CHANGED, notices=1))
    tab.wait_for("document.getElementById('phase').textContent === 'Later.'")
    assert tab.evaluate("document.getElementById('notice').hidden"), "it is no news"


def test_an_errand_during_a_round_needs_a_choice_of_time(page: Any, tab: Tab) -> None:
    waiting = DeliveryView(
        state="waiting", place="table_1", waits_for="taken", round_active=True, queue=("table_2",)
    )
    page.server.set_layer("delivery", waiting)
    tab.wait_for("!document.getElementById('taken').hidden")
    tab.evaluate("document.querySelector('#places button').click()")
    assert not tab.evaluate("document.getElementById('when').hidden") and page.commands.empty()
    tab.evaluate("document.getElementById('when_after').click()")
    assert page.next_command() == GoPlace("<b>kitchen</b>", "after")
    assert tab.evaluate("document.getElementById('when').hidden")
    tab.evaluate("document.getElementById('taken').click()")
    command = page.next_command()
    assert (type(command).__name__, command.place) == ("Taken", "table_1")
    unloading = DeliveryView(state="unloading", place="kitchen", waits_for="taken", round_active=True)
    page.server.set_layer("delivery", unloading)
    tab.wait_for("document.getElementById('taken').textContent === 'Unloaded'")
    page.server.set_layer(
        "delivery",
        DeliveryView(
            state="driving",
            place="table_2",
            waits_for="choice",
            round_active=True,
            choices=("go_on", "kitchen", "end"),
        ),
    )
    tab.wait_for("!document.getElementById('go_on').hidden")
    assert tab.evaluate("document.getElementById('go_on').textContent") == "Go on to Table 2"
    tab.evaluate("document.getElementById('kitchen').click()")
    assert page.next_command().choice == "kitchen"
