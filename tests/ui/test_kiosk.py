"""Tests of the view on the robot's own screen: what it shows, its button, and the PIN to leave."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab
from tests.ui.conftest import Page
from tests.ui.faulty_network import FaultyNetwork

from chefbot.errors import UserError
from chefbot.ui.access.kiosk_lock import ATTEMPTS, PERIOD, KioskLock
from chefbot.ui.commands import Loaded, Taken
from chefbot.ui.display.views import DeliveryView, StopView
from chefbot.ui.server import WebUiServer

PIN = "2468"
TITLE = "document.getElementById('kiosk-title').textContent"
WRONG_AT_ONCE = """new Promise((done) => {
  const form = document.getElementById('kiosk-pin');
  new MutationObserver(() => {
    document.getElementById('kiosk-digits').value = '1112';
    form.querySelector('.primary').click();
    done();
  }).observe(form, { attributes: true });
  document.getElementById('kiosk-leave').click();
})"""
"""A wrong PIN in the very moment in which the web UI wants it, before the robot has answered the next ping."""
AT_ITS_MIDDLE = """(() => {{
  const button = document.getElementById('{0}'), box = button.getBoundingClientRect();
  return button.contains(document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2));
}})()"""
"""Whether a button is at the top at its middle."""
LEFT = "!document.body.classList.contains('kiosk')"


class Kiosk(Page):
    """A web UI with a PIN."""

    delivery: DeliveryView | None = None

    def __init__(self) -> None:
        super().__init__()
        self.server.stop()
        self.serve()

    def serve(self) -> None:
        """Serve at the port of the one before; its layers are set again as a robot does."""
        port = urlsplit(self.url).port or 0
        self.server = WebUiServer(
            port, "127.0.0.1", lambda command, _: self.on_command(command), kiosk_pin=PIN
        )
        self.url = self.server.start()
        self.server.set_layer("delivery", self.delivery)

    def wait_at(self, delivery: DeliveryView) -> None:
        """Let the robot wait for a confirmation."""
        self.delivery = delivery
        self.server.set_layer("delivery", delivery)


@pytest.fixture
def kiosk() -> Iterator[Kiosk]:
    served = Kiosk()
    yield served
    served.server.stop()


def enter(tab: Tab, pin: str) -> None:
    """Type a PIN and press "Leave"."""
    tab.evaluate(f"document.getElementById('kiosk-digits').value = '{pin}'")
    tab.evaluate("document.querySelector('#kiosk-pin .primary').click()")


@pytest.mark.slow
@needs_chromium
def test_the_robots_screen_is_left_with_the_pin(kiosk: Kiosk) -> None:
    with open_tab(f"{kiosk.url}#kiosk", NO_GPU) as tab:
        tab.wait_for(f"{TITLE} === 'No delivery'")
        kiosk.wait_at(DeliveryView(waits_for="loaded", place="kitchen", state="loading"))
        tab.wait_for(f"{TITLE} === 'Load the food'")
        tab.click("#kiosk-confirm")
        assert kiosk.next_command() == Loaded("kitchen")
        kiosk.wait_at(DeliveryView(waits_for="taken", place="table_3", state="waiting"))
        tab.wait_for(f"{TITLE} === 'Table 3: your food'")
        tab.click("#kiosk-confirm")
        assert kiosk.next_command() == Taken("table_3")
        kiosk.wait_at(DeliveryView(waits_for="taken", place="kitchen", state="unloading"))
        tab.wait_for(f"{TITLE} === 'Unload the food'")
        assert tab.evaluate("document.getElementById('kiosk-confirm').textContent") == "Unloaded"
        kiosk.wait_at(DeliveryView(waits_for="taken", place="table_3", state="waiting"))
        tab.wait_for(f"{TITLE} === 'Table 3: your food'")
        assert tab.evaluate("getComputedStyle(document.getElementById('stop')).display") != "none"
        assert tab.evaluate("document.getElementById('map').offsetParent") is None

        for address in ("#3d", "#"):
            tab.evaluate(f"location.hash = '{address}'")
            tab.wait_for(f"location.hash === '#kiosk' && !({LEFT})")
        kiosk.server.set_layer("stop", StopView(stopped=True))
        tab.wait_for(f"{TITLE} === 'Stopped'")
        kiosk.server.set_layer("stop", StopView())
        tab.wait_for(f"{TITLE} === 'Table 3: your food'")
        kiosk.server.stop()
        tab.wait_for(f"{TITLE} === 'Please wait' && document.getElementById('kiosk-confirm').hidden")
        kiosk.serve()
        tab.wait_for(f"{TITLE} === 'Table 3: your food'")

        tab.click("#kiosk-leave")
        tab.wait_for("!document.getElementById('kiosk-pin').hidden")
        enter(tab, "1111")
        tab.wait_for("document.getElementById('kiosk-note').textContent === 'The PIN is wrong'")
        assert not tab.evaluate(LEFT)
        for digit in f"{PIN}9":  # a touch screen may have no keyboard
            tab.click(f"#kiosk-keys button:nth-child({int(digit)})")
        tab.click("#kiosk-erase")
        assert tab.evaluate("document.getElementById('kiosk-digits').value") == PIN
        tab.click("#kiosk-pin .primary")
        tab.wait_for(LEFT)
        show_a_room(kiosk.server)
        tab.wait_for("document.querySelectorAll('#tables button').length === 2")  # all layers are sent again
        assert tab.evaluate("location.hash") == ""


@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize(("width", "height"), [(800, 480), (844, 390), (1024, 600), (390, 844)])
def test_no_button_of_the_screen_lies_under_stop(page: Page, width: int, height: int) -> None:
    with open_tab(f"{page.url}#kiosk", NO_GPU) as tab:
        tab.resize(width, height)
        tab.wait_for("!document.body.classList.contains('offline')")
        for button in ("kiosk-leave", "stop"):
            assert tab.evaluate(AT_ITS_MIDDLE.format(button)), f"{button} is covered"


@pytest.mark.slow
@needs_chromium
def test_the_screen_names_the_table_to_which_it_drives(page: Page) -> None:
    page.server.set_layer("labels", {"table_3": "Window"})
    page.server.set_layer(
        "delivery", DeliveryView(state="driving", place="table_3", step="On the way to table 3.")
    )
    with open_tab(f"{page.url}#kiosk", NO_GPU) as tab:
        tab.wait_for(f"{TITLE} === 'On the way to Window'")
        assert tab.evaluate("document.getElementById('kiosk-text').textContent") == ""
        page.server.set_layer("labels", {"table_3": "Bar"})
        tab.wait_for(f"{TITLE} === 'On the way to Bar'")


@pytest.mark.slow
@needs_chromium
def test_the_answer_to_an_earlier_press_opens_nothing(kiosk: Kiosk) -> None:
    network = FaultyNetwork(urlsplit(kiosk.url).port or 0)
    with open_tab(f"http://127.0.0.1:{network.port}/#kiosk", NO_GPU) as tab:
        tab.wait_for("!document.body.classList.contains('offline')")
        network.mode, network.delay = "late", 0.2
        tab.evaluate("new Promise((done) => setTimeout(done, 1000))")
        tab.evaluate(WRONG_AT_ONCE)
        tab.evaluate("new Promise((done) => setTimeout(done, 2000))")  # the next ping is answered first
        assert not tab.evaluate(LEFT)
    network.close()


@pytest.mark.slow
@needs_chromium
def test_without_a_pin_one_press_leaves(page: Page) -> None:
    with open_tab(f"{page.url}#kiosk", NO_GPU) as tab:
        tab.wait_for("!document.body.classList.contains('offline')")
        tab.click("#kiosk-leave")
        tab.wait_for(LEFT)
        tab.evaluate("location.hash = '#kiosk'")
        tab.wait_for(f"!({LEFT})")


def test_a_pin_cannot_be_guessed() -> None:
    lock = KioskLock(PIN)
    for attempt in range(ATTEMPTS):
        with pytest.raises(UserError, match="The PIN is wrong"):
            lock.check(f"000{attempt}", float(attempt))
    for pin in ("9999", PIN):
        with pytest.raises(UserError, match=f"wait {PERIOD - 10:.0f} s"):
            lock.check(pin, 10.0)
    lock.check(PIN, PERIOD)
    guesses = 0
    for now in itertools.takewhile(lambda second: second < 3600, itertools.count()):
        with pytest.raises(UserError) as refusal:
            lock.check("0000", float(now) + 2 * PERIOD)
        guesses += "The PIN is wrong" in str(refusal.value)
    assert guesses <= 3600 / PERIOD * ATTEMPTS


def test_no_pin_is_needed_if_the_owner_sets_none() -> None:
    KioskLock("").check("", 0.0)
    with pytest.raises(UserError, match="Enter the PIN"):
        KioskLock(PIN).check("", 0.0)
