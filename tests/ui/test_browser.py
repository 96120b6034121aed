"""The page in a real browser: it draws, and a drag, the joystick and STOP reach the robot. Needs Chromium."""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from websockets.sync.client import connect

from chefbot.maths.grid import Grid
from chefbot.ui.commands import Deliver, Drive, Goal, Stop
from chefbot.ui.layers import RobotView, Status

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--remote-debugging-port=0", "--window-size=1280,800"),
]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: `apt-get install chromium` to run this"),
]


class Tab:
    """One tab, spoken to by the Chrome DevTools protocol."""

    def __init__(self, connection: Any) -> None:
        self._connection = connection
        self._number = 0

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        self._number += 1
        self._connection.send(json.dumps({"id": self._number, "method": method, "params": params}))
        while True:
            answer = json.loads(self._connection.recv(timeout=30))
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return dict(answer["result"])

    def ask(self, script: str) -> Any:
        return self.call("Runtime.evaluate", expression=script, awaitPromise=True)["result"].get("value")

    def wait_for(self, script: str) -> None:
        for _ in range(300):
            if self.ask(script):
                return
            time.sleep(0.1)
        raise AssertionError(f"never true in the page: {script}")

    def mouse(self, kind: str, x: float, y: float) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def middle(self, selector: str) -> tuple[float, float]:
        box = self.ask(f"JSON.stringify(document.querySelector({selector!r}).getBoundingClientRect())")
        rect = json.loads(box)
        return rect["x"] + rect["width"] / 2, rect["y"] + rect["height"] / 2

    def click(self, selector: str) -> None:
        place = self.middle(selector)
        self.mouse("mousePressed", *place)
        self.mouse("mouseReleased", *place)


@pytest.fixture
def tab(page: Any, tmp_path: Path) -> Iterator[Tab]:
    show_a_room(page.server)
    assert CHROMIUM is not None
    process = subprocess.Popen(
        [CHROMIUM, *FLAGS, f"--user-data-dir={tmp_path}", page.url], stderr=subprocess.DEVNULL
    )
    try:
        with connect(devtools_address(tmp_path, page.url), max_size=None) as connection:
            one = Tab(connection)
            one.wait_for("document.querySelectorAll('#tables button').length === 2")
            yield one
    finally:
        process.terminate()
        process.wait()


def devtools_address(folder: Path, url: str) -> str:
    for _ in range(300):
        time.sleep(0.1)
        with contextlib.suppress(OSError, httpx.TransportError, StopIteration):
            port = (folder / "DevToolsActivePort").read_text().split()[0]
            tabs = httpx.get(f"http://127.0.0.1:{port}/json").json()
            return str(next(one for one in tabs if one["url"] == url)["webSocketDebuggerUrl"])
    raise AssertionError("Chromium did not start")


def show_a_room(server: Any) -> None:
    cells = np.zeros((160, 240), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    server.show("map", Grid(cells, 0.05, -2.0, -1.0))
    server.show("robot", RobotView(x=1.0, y=1.0, yaw=0.0, radius=0.2))
    server.show("places", {"table_1": (2, 2, 0), "table_2": (4, 2, 0), "<b>kitchen</b>": (6, 2, 0)})
    server.show(
        "status", Status(phase="Waiting for an order.", simulation=True, localization_error=0.05, clock=1.0)
    )


def test_the_page_draws_and_its_gestures_reach_the_robot(page: Any, tab: Tab) -> None:
    assert tab.ask("document.getElementById('phase').textContent") == "Waiting for an order."
    assert tab.ask("document.querySelectorAll('#places b').length") == 0
    tab.wait_for(
        "new Set(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data).size > 8"
    )
    x, y = tab.middle("#canvas")
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


def test_the_joystick_drives_until_it_is_let_go_and_stop_stops(page: Any, tab: Tab) -> None:
    x, y = tab.middle("#stick")
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseMoved", x, y - 50)
    while (command := page.next_command()) == Drive(0.0, 0.0):
        pass
    assert isinstance(command, Drive)
    assert 0 < command.v <= 0.5
    assert command.w == 0
    tab.ask("document.getElementById('stop').click()")
    while isinstance(command, Drive):
        command, before = page.next_command(), command
    assert command == Stop()
    assert before == Drive(0.0, 0.0)


def test_the_page_says_that_the_connection_is_lost(page: Any, tab: Tab) -> None:
    page.server.stop()
    tab.wait_for("document.body.classList.contains('offline')")
    assert "No connection" in tab.ask("document.getElementById('phase').textContent")
