"""Controls a headless Chromium by the Chrome DevTools protocol."""

from __future__ import annotations

import atexit
import base64
import contextlib
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from tests.support.waiting import PATIENCE
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--window-size=1280,800"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--disable-features=BackForwardCache",  # nobody goes back to a page that a test has left
    "--remote-debugging-port=0",
]
NO_GPU = ["--disable-gpu"]
SCREENSHOTS = "CHEFBOT_SCREENSHOTS"
"""Environment variable with the folder for pictures of all tabs that tests open."""
SOFTWARE_GL = [
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=800,600",
]
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: `apt-get install chromium`")


def pixels(red: int, green: int, blue: int) -> str:
    """Return the expression for the number of pixels of the map in a colour."""
    return pixels_where(f"r === {red} && g === {green} && b === {blue}")


def pixels_where(condition: str) -> str:
    """Return the expression for the number of pixels of the map for which a condition on r, g and b is true."""
    return f"""(() => {{
      const {{ width, height }} = canvas, data = canvas.getContext('2d').getImageData(0, 0, width, height).data;
      let count = 0;
      for (let i = 0; i < data.length; i += 4) {{
        const [r, g, b] = [data[i], data[i + 1], data[i + 2]];
        count += {condition};
      }}
      return count;
    }})()"""


BETWEEN_DOCUMENTS = "Inspected target navigated or closed"
"""Why Chromium refuses calls while a page loads again."""


class Tab:
    """A tab of the browser; `events` contains its requests, exceptions and console messages."""

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

    def evaluate(self, script: str) -> Any:
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]["exception"]["description"]
        return result["result"].get("value")

    def wait_for(self, script: str) -> None:
        """Wait until a condition holds, also over a page that loads itself again meanwhile."""
        for _ in range(300):
            try:
                if self.evaluate(script):
                    return
            except AssertionError as error:
                if BETWEEN_DOCUMENTS not in str(error):
                    raise
            time.sleep(0.1)
        raise AssertionError(f"the condition was never true in the page: {script}")

    def reload_by(self, script: str) -> None:
        """Run a script that loads the page again, and wait until it has loaded.

        Between two documents Chromium refuses calls or never answers them, so nothing is called meanwhile.
        """
        before = len(self.events)
        self.evaluate(f"void setTimeout(() => {{ {script} }}, 100)")
        self.wait_for_event("Page.loadEventFired", self.wait_for_event("Page.frameNavigated", before))

    def wait_for_event(self, method: str, after: int) -> int:
        """Wait for an event, not counting the first ones; return how many there are up to it."""
        while True:
            for number, event in enumerate(self.events[after:], after + 1):
                if event["method"] == method:
                    return number
            self.events.append(json.loads(self._connection.recv(timeout=PATIENCE)))

    def resize(self, width: int, height: int) -> None:
        """Give the view a size in pixels of the style sheet."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def mouse(self, kind: str, x: float, y: float) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def centre(self, selector: str) -> tuple[float, float]:
        box = self.evaluate(f"JSON.stringify(document.querySelector({selector!r}).getBoundingClientRect())")
        rect = json.loads(box)
        return rect["x"] + rect["width"] / 2, rect["y"] + rect["height"] / 2

    def click(self, selector: str) -> None:
        centre = self.centre(selector)
        self.mouse("mousePressed", *centre)
        self.mouse("mouseReleased", *centre)

    def requested_urls(self) -> list[str]:
        """Return the URLs of all requests and WebSockets of the page."""
        requests = [item["params"] for item in self.events if item["method"] == "Network.requestWillBeSent"]
        sockets = [item["params"] for item in self.events if item["method"] == "Network.webSocketCreated"]
        return [item["request"]["url"] for item in requests] + [item["url"] for item in sockets]

    def errors(self) -> list[dict[str, Any]]:
        """Return the exceptions, errors and warnings of the page."""
        thrown = [item for item in self.events if item["method"] == "Runtime.exceptionThrown"]
        logged = [item["params"]["entry"] for item in self.events if item["method"] == "Log.entryAdded"]
        console = [item["params"] for item in self.events if item["method"] == "Runtime.consoleAPICalled"]
        return [
            *thrown,
            *(item for item in logged if item["level"] in ("error", "warning")),
            *(item for item in console if item["type"] in ("error", "warning", "assert")),
        ]


class Profile(NamedTuple):
    """A tab with cookies and storage of its own."""

    context: str
    address: str


class Browser:
    """A browser that runs until this process ends; its tabs know nothing of each other."""

    def __init__(self, flags: tuple[str, ...]) -> None:
        assert CHROMIUM is not None
        self._stack = contextlib.ExitStack()
        folder = self._stack.enter_context(
            tempfile.TemporaryDirectory(prefix="chefbot_browser_", ignore_cleanup_errors=True)
        )
        command = [CHROMIUM, *FLAGS, *flags, f"--user-data-dir={folder}", "about:blank"]
        self._process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        self._stack.callback(self._end)
        self.port, self._path = _devtools_address(Path(folder))
        self._unused: list[Profile] = []
        atexit.register(self._stack.close)

    @property
    def is_running(self) -> bool:
        return self._process.poll() is None

    def _end(self) -> None:
        self._process.terminate()
        self._process.wait()

    @contextlib.contextmanager
    def profile(self) -> Iterator[str]:
        """Yield the DevTools address of an empty tab without cookies and storage.

        A new one costs a process that compiles all scripts again, so tests share one until one of them fails.
        Nothing stays connected: a thread that draws random numbers for its pings would disturb Hypothesis.
        """
        profile = self._unused.pop() if self._unused else self._new_profile()
        try:
            yield profile.address
            _forget(profile)
        except BaseException:
            with self._connected() as browser:
                browser.call("Target.disposeBrowserContext", browserContextId=profile.context)
            raise
        self._unused.append(profile)

    def _new_profile(self) -> Profile:
        with self._connected() as browser:
            context = browser.call("Target.createBrowserContext")["browserContextId"]
            new = browser.call("Target.createTarget", url="about:blank", browserContextId=context)
        return Profile(context, f"ws://127.0.0.1:{self.port}/devtools/page/{new['targetId']}")

    @contextlib.contextmanager
    def _connected(self) -> Iterator[Tab]:
        with _connect(f"ws://127.0.0.1:{self.port}{self._path}") as connection:
            yield Tab(connection)


def _forget(profile: Profile) -> None:
    """Empty a tab, its storage, and what its browser keeps of the addresses that it visited."""
    with _connect(profile.address) as connection:
        tab = Tab(connection)
        origin = tab.evaluate("location.origin")
        tab.call("Page.navigate", url="about:blank")
        tab.wait_for("location.href === 'about:blank' && document.readyState === 'complete'")
        if origin.startswith("http"):
            tab.call("Storage.clearDataForOrigin", origin=origin, storageTypes="all")
        tab.call("Network.clearBrowserCookies")
        tab.call("Network.clearBrowserCache")


_BROWSERS: dict[tuple[str, ...], Browser] = {}


def _browser(flags: tuple[str, ...]) -> Browser:
    """Return the browser of this process with these flags; a new one if there is none, or if it has crashed."""
    if flags not in _BROWSERS or not _BROWSERS[flags].is_running:
        _BROWSERS[flags] = Browser(flags)
    return _BROWSERS[flags]


@contextlib.contextmanager
def open_tab(url: str, flags: list[str]) -> Iterator[Tab]:
    """Open a tab whose events are recorded from the first request on."""
    with _browser(tuple(flags)).profile() as address, _connect(address) as connection:
        tab = Tab(connection)
        for domain in ("Network", "Log", "Runtime", "Page"):
            tab.call(f"{domain}.enable")
        tab.call("Page.navigate", url=url)
        tab.wait_for("document.readyState === 'complete'")
        try:
            yield tab
        finally:
            if folder := os.environ.get(SCREENSHOTS):
                _keep_picture(tab, Path(folder))


def _keep_picture(tab: Tab, folder: Path) -> None:
    """Write what the tab shows at the end of a test, also of one that failed, named after the test."""
    test = os.environ.get("PYTEST_CURRENT_TEST", "page").rpartition("/")[2].partition(" ")[0]
    name = re.sub(r"[^A-Za-z0-9_.-]+", "-", test).strip("-")[:120]
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(AssertionError, TimeoutError, ConnectionClosed):  # the test closed its tab
        picture = base64.b64decode(tab.call("Page.captureScreenshot")["data"])
        (folder / f"{name}.png").write_bytes(picture)


def _connect(address: str) -> ClientConnection:
    """Connect to DevTools; with a limit, events that nobody has read yet would delay the end by ten seconds."""
    return connect(address, max_size=None, max_queue=None)


def _devtools_address(folder: Path) -> tuple[int, str]:
    """Return port and path of the browser's own DevTools endpoint, which it writes into its folder."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError, ValueError):
            port, path = (folder / "DevToolsActivePort").read_text().split()
            return int(port), path
        time.sleep(0.05)
    raise AssertionError("Chromium did not start")
