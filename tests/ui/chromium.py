"""Chromium without a screen, spoken to by the Chrome DevTools protocol."""

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
import pytest
from tests.support.waiting import PATIENCE
from websockets.sync.client import connect

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--window-size=1280,800"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--remote-debugging-port=0",
]
NO_GPU = ["--disable-gpu"]
SOFTWARE_GL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here: `apt-get install chromium` to run this"
)


class Tab:
    """One tab; `events` holds what it told meanwhile: requests, exceptions, the console."""

    def __init__(self, connection: Any) -> None:
        self._connection = connection
        self._number = 0
        self.events: list[dict[str, Any]] = []

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        self._number += 1
        self._connection.send(json.dumps({"id": self._number, "method": method, "params": params}))
        while True:
            answer = json.loads(self._connection.recv(timeout=PATIENCE))
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return dict(answer["result"])
            self.events.append(answer)

    def ask(self, script: str) -> Any:
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]["exception"]["description"]
        return result["result"].get("value")

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

    def requested(self) -> list[str]:
        """Every address that the page asked for."""
        sent = [one["params"] for one in self.events if one["method"] == "Network.requestWillBeSent"]
        sockets = [one["params"] for one in self.events if one["method"] == "Network.webSocketCreated"]
        return [one["request"]["url"] for one in sent] + [one["url"] for one in sockets]

    def complaints(self) -> list[dict[str, Any]]:
        """Exceptions, errors and warnings of the page."""
        thrown = [one for one in self.events if one["method"] == "Runtime.exceptionThrown"]
        logged = [one["params"]["entry"] for one in self.events if one["method"] == "Log.entryAdded"]
        said = [one["params"] for one in self.events if one["method"] == "Runtime.consoleAPICalled"]
        return [
            *thrown,
            *(one for one in logged if one["level"] in ("error", "warning")),
            *(one for one in said if one["type"] in ("error", "warning", "assert")),
        ]


@contextlib.contextmanager
def open_tab(url: str, folder: Path, flags: list[str]) -> Iterator[Tab]:
    """A browser of its own with one tab, which is listened to from its first request on."""
    assert CHROMIUM is not None
    command = [CHROMIUM, *FLAGS, *flags, f"--user-data-dir={folder}", "about:blank"]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        with connect(_devtools_address(folder), max_size=None) as connection:
            tab = Tab(connection)
            for domain in ("Network", "Log", "Runtime", "Page"):
                tab.call(f"{domain}.enable")
            tab.call("Page.navigate", url=url)
            tab.wait_for("document.readyState === 'complete'")
            yield tab
    finally:
        process.terminate()
        process.wait()


def _devtools_address(folder: Path) -> str:
    give_up = time.monotonic() + PATIENCE
    while time.monotonic() < give_up:
        time.sleep(0.1)
        with contextlib.suppress(OSError, httpx.TransportError, StopIteration, IndexError):
            port = (folder / "DevToolsActivePort").read_text().split()[0]
            tabs = httpx.get(f"http://127.0.0.1:{port}/json").json()
            return str(next(one for one in tabs if one["url"] == "about:blank")["webSocketDebuggerUrl"])
    raise AssertionError("Chromium did not start")
