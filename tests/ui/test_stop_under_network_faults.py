"""STOP over a network that fails at any moment: pressed, it is confirmed by the base in the end, and never unsaid."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from tests.support.two_web_uis import Robot
from tests.support.waiting import wait_for
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab
from tests.ui.faulty_network import Proxy

from chefbot.ui.commands import Resume

pytestmark = [pytest.mark.slow, needs_chromium]
FAULTS = ["none", "hole before", "hole after", "reset before", "reset after", "late", "reset while late"]
STOP = "document.getElementById('stop')?.textContent"
ALARM = "!document.getElementById('alarm').hidden"


class Phone:
    """A browser, a network that fails, and a robot's page and base behind it."""

    def __init__(self, tab: Tab, network: Proxy, robot: Robot) -> None:
        self.tab, self.network, self.robot = tab, network, robot

    @property
    def stopped(self) -> bool:
        return bool(self.robot.said) and self.robot.said[-1]

    def release(self) -> None:
        """From another screen, until all know it."""
        with self.robot.page("there") as other:
            other.send(Resume())
            wait_for(lambda: not self.stopped)
        self.tab.wait_for(f"{STOP} === 'STOP' && !document.body.classList.contains('offline')")

    def press(self, fault: str) -> None:
        """What the page shows at once, then with the fault, then after its end; and what the base has latched."""
        before, _, after = fault.partition(" ")
        if fault in ("hole before", "late", "reset while late"):
            self.network.mode, self.network.delay = ("hole", 0.0) if before == "hole" else ("late", 0.5)
        elif fault == "reset before":
            self.network.reset()
        shown = self.tab.ask(
            f"document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown')), {STOP}"
        )
        assert shown == "STOP: not confirmed", "at once, whatever the network does"
        if fault == "hole after":
            self.network.mode = "hole"
        elif after:
            self.network.reset()
        if fault == "hole before":
            self.tab.wait_for(ALARM)
            self.tab.wait_for("document.body.classList.contains('offline')")
            assert not self.stopped and self.tab.ask(STOP) == "STOP: not confirmed"
        self.network.mode = "pass"
        self.tab.wait_for(f"{STOP} === 'STOPPED' && !({ALARM})")
        assert self.stopped, "STOPPED is said when the base has latched it"


@pytest.fixture
def phone(tmp_path: Path) -> Iterator[Phone]:
    robot = Robot(base=True)
    network = Proxy(urlsplit(robot.system.nodes["here"].url).port or 0)  # type: ignore[attr-defined]
    try:
        with open_tab(f"http://127.0.0.1:{network.port}/", tmp_path, NO_GPU) as tab:
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
    chance = random.Random(1)
    for _ in range(100):
        phone.press(chance.choice(FAULTS))
        phone.release()


def test_a_withdrawn_press_does_not_count_when_it_arrives(phone: Phone) -> None:
    phone.network.mode = "hole"
    phone.tab.ask("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
    phone.tab.wait_for(ALARM)
    assert phone.tab.ask("document.getElementById('resume').textContent") == "Withdraw this stop"
    phone.tab.ask("document.getElementById('resume').click()")
    phone.network.mode = "pass"
    phone.tab.wait_for(f"{STOP} === 'STOP' && !({ALARM}) && !document.body.classList.contains('offline')")
    assert not phone.stopped


def test_a_reloaded_page_continues_its_request(phone: Phone) -> None:
    phone.network.mode = "hole"
    phone.tab.ask("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
    phone.network.mode = "pass"
    phone.network.reset()
    phone.tab.call("Page.reload")
    phone.tab.wait_for(f"{STOP} === 'STOPPED'")
    assert phone.stopped


def test_escape_is_stop_anywhere_on_the_page(phone: Phone) -> None:
    for focus in ("canvas", "deliver", "fit", "stick"):
        phone.tab.ask(f"document.getElementById('{focus}').focus()")
        phone.tab.call("Input.dispatchKeyEvent", type="keyDown", key="Escape", code="Escape")
        phone.tab.call("Input.dispatchKeyEvent", type="keyUp", key="Escape", code="Escape")
        phone.tab.wait_for(f"{STOP} === 'STOPPED'")
        phone.release()
