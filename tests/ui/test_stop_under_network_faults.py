"""Tests that an emergency stop from the web UI is confirmed by the base under network faults."""

from __future__ import annotations

import random
import time
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from tests.support.two_web_uis import Robot
from tests.support.waiting import wait_for
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab
from tests.ui.faulty_network import FaultyNetwork

from chefbot.ui.commands import ReleaseStop

pytestmark = [pytest.mark.slow, needs_chromium]
FAULTS = ["none", "hole before", "hole after", "reset before", "reset after", "late", "reset while late"]
STOP = "document.getElementById('stop')?.textContent"
ALARM = "!document.getElementById('alarm').hidden"


class Phone:
    """A browser that is connected to a robot by a network with faults."""

    def __init__(self, tab: Tab, network: FaultyNetwork, robot: Robot) -> None:
        self.tab, self.network, self.robot = tab, network, robot

    @property
    def stopped(self) -> bool:
        return bool(self.robot.stop_states) and self.robot.stop_states[-1]

    def release(self) -> None:
        """Release the stop from another web UI and wait until all show it."""
        with self.robot.page("there") as other:
            other.send(ReleaseStop())
            wait_for(lambda: not self.stopped)
        self.tab.wait_for(f"{STOP} === 'STOP' && !document.body.classList.contains('offline')")

    def press(self, fault: str) -> None:
        """Press STOP under a fault and check what the web UI shows at once, during the fault and after it."""
        before, _, after = fault.partition(" ")
        if fault in ("hole before", "late", "reset while late"):
            self.network.mode, self.network.delay = ("hole", 0.0) if before == "hole" else ("late", 0.5)
        elif fault == "reset before":
            self.network.reset()
        shown = self.tab.evaluate(
            f"document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown')), {STOP}"
        )
        assert shown == "STOP: not confirmed", "the press is shown at once under any fault"
        if fault == "hole after":
            self.network.mode = "hole"
        elif after:
            self.network.reset()
        if fault == "hole before":
            self.tab.wait_for(ALARM)
            self.tab.wait_for("document.body.classList.contains('offline')")
            assert not self.stopped and self.tab.evaluate(STOP) == "STOP: not confirmed"
        self.network.mode = "pass"
        self.tab.wait_for(f"{STOP} === 'STOPPED' && !({ALARM})")
        assert self.stopped, "STOPPED is shown when the base has latched the stop"


@pytest.fixture
def phone() -> Iterator[Phone]:
    robot = Robot(base=True)
    network = FaultyNetwork(urlsplit(robot.system.nodes["here"].url).port or 0)  # type: ignore[attr-defined]
    try:
        with open_tab(f"http://127.0.0.1:{network.port}/", NO_GPU) as tab:
            tab.wait_for("!document.body.classList.contains('offline')")
            yield Phone(tab, network, robot)
    finally:
        network.close()
        robot.stop()


def test_a_press_is_confirmed_under_any_network_fault(phone: Phone) -> None:
    for fault in FAULTS:
        phone.press(fault)
        phone.release()


@pytest.mark.long
def test_a_hundred_presses_are_all_confirmed(phone: Phone) -> None:
    rng = random.Random(1)
    for _ in range(100):
        phone.press(rng.choice(FAULTS))
        phone.release()


def test_a_press_arrives_without_a_web_socket(phone: Phone) -> None:
    """A browser makes one web socket of a host after the other, and each attempt may hang for seconds."""
    hangs = "{ readyState: 0, binaryType: '', close() {}, send() {} }"
    phone.tab.evaluate(f"window.WebSocket = function () {{ return {hangs}; }}, 0")
    phone.network.reset()
    phone.tab.wait_for("document.body.classList.contains('offline')")
    phone.tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown')), 0")
    wait_for(lambda: phone.stopped)
    assert phone.tab.evaluate(STOP) == "STOP: not confirmed", "only a confirmation of the base ends the alarm"


def test_a_withdrawn_press_does_not_count_when_it_arrives(phone: Phone) -> None:
    phone.network.mode = "hole"
    phone.tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
    phone.tab.wait_for(ALARM)
    assert (
        phone.tab.evaluate("document.getElementById('release-stop').textContent") == "Cancel the stop request"
    )
    phone.tab.evaluate("document.getElementById('release-stop').click()")
    phone.network.mode = "pass"
    phone.tab.wait_for(f"{STOP} === 'STOP' && !({ALARM}) && !document.body.classList.contains('offline')")
    assert not phone.stopped


def test_a_slow_connection_is_given_up_without_an_error(phone: Phone) -> None:
    """An answer after 4 s is too late for the web UI, which tries again; another one may be accepted by then."""
    phone.network.mode, phone.network.delay = "late", 4.0
    before = phone.network.accepted
    phone.network.reset()
    wait_for(lambda: phone.network.accepted > before + 1)
    phone.network.mode = "pass"
    phone.tab.wait_for("!document.body.classList.contains('offline')")
    assert [one for one in phone.tab.errors() if "before the connection is established" in str(one)] == []


def test_a_reloaded_page_continues_its_request(phone: Phone) -> None:
    phone.network.mode = "hole"
    phone.tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
    phone.network.mode = "pass"
    phone.network.reset()
    phone.tab.call("Page.reload")
    phone.tab.wait_for(f"{STOP} === 'STOPPED'")
    assert phone.stopped


def test_escape_is_stop_anywhere_on_the_page(phone: Phone) -> None:
    for focus in ("canvas", "deliver", "fit", "stick"):
        phone.tab.evaluate(f"document.getElementById('{focus}').focus()")
        phone.tab.call("Input.dispatchKeyEvent", type="keyDown", key="Escape", code="Escape")
        phone.tab.call("Input.dispatchKeyEvent", type="keyUp", key="Escape", code="Escape")
        phone.tab.wait_for(f"{STOP} === 'STOPPED'")
        phone.release()


def time_of_attempts(network: FaultyNetwork, count: int) -> float:
    """Return the time until the browser has tried that often to connect, s."""
    start, before = time.monotonic(), network.accepted
    wait_for(lambda: network.accepted >= before + count)
    return time.monotonic() - start


def test_a_press_does_not_wait_for_the_next_attempt_to_connect(phone: Phone) -> None:
    phone.network.mode = "refused"
    phone.network.reset()
    phone.tab.wait_for("document.body.classList.contains('offline')")
    time_of_attempts(phone.network, 10)  # the pauses are long by now
    usual = time_of_attempts(phone.network, 4)
    phone.tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown')), 0")
    assert time_of_attempts(phone.network, 4) < 0.6 * usual
    phone.network.mode = "pass"
    phone.tab.wait_for(f"{STOP} === 'STOPPED' && !({ALARM})")
    assert phone.stopped
