"""Tests drawing and operation of the web UI in Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.ui.commands import Deliver, Drive, Goal, Stop

pytestmark = [pytest.mark.slow, needs_chromium]


@pytest.fixture
def tab(page: Any) -> Iterator[Tab]:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as opened:
        opened.wait_for("document.querySelectorAll('#tables button').length === 2")
        yield opened


def test_web_ui_draws_layers_and_sends_goals_and_orders(page: Any, tab: Tab) -> None:
    assert tab.evaluate("document.getElementById('phase').textContent") == "Waiting for an order."
    assert tab.evaluate("document.querySelectorAll('#places b').length") == 0
    tab.wait_for(
        "new Set(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data).size > 8"
    )
    x, y = tab.centre("#canvas")
    tab.click("[data-tool=goal]")
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseMoved", x, y - 80)
    tab.mouse("mouseReleased", x, y - 80)
    goal = page.next_command()
    assert isinstance(goal, Goal)
    assert goal.yaw == pytest.approx(np.pi / 2)
    assert goal.x == pytest.approx(-2.0 + 6.0, abs=0.1)
    tab.click("#tables [data-name=table_2]")
    tab.click("#deliver")
    assert page.next_command() == Deliver(["table_2"])


def test_joystick_drives_until_release_and_stop_stops(page: Any, tab: Tab) -> None:
    x, y = tab.centre("#stick")
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseMoved", x, y - 50)
    while (command := page.next_command()) == Drive(0.0, 0.0):
        pass
    assert isinstance(command, Drive)
    assert 0 < command.v <= 0.5
    assert command.w == 0
    tab.evaluate("document.getElementById('stop').click()")
    while isinstance(command, Drive):
        command, before = page.next_command(), command
    assert isinstance(command, Stop)
    assert before == Drive(0.0, 0.0)


def test_a_lost_connection_is_shown(page: Any, tab: Tab) -> None:
    page.server.stop()
    tab.wait_for("document.body.classList.contains('offline')")
    assert "No connection" in tab.evaluate("document.getElementById('phase').textContent")
