"""Floods of the web UI from other processes: the base's command rate, STOP's delay, and a new operator's access.

A launch with a drive base in wall time and its web UI at the network is attacked by processes of their own, without
a token and with one. For each attack: the rate of wheel commands at a subscriber and the gaps between them, the time
from STOP in a browser that is connected to the base's confirmation, the time until a new operator with a token gets
in (at another address than the attacker, and at the same), and the CPU time of the web UI's and the base's process.
All but the last are wall times, which other load prolongs.

Run: python bench/bench_page_flood.py [SECONDS] [in_base]

`in_base` serves the web UI in the process of the base, for comparison.
"""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import os
import re
import socket
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray
from websockets.asyncio.client import connect as connect_async
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.launch_process import LaunchProcess, run_chefbot, wait_for  # noqa: E402
from tests.support.processes import children_of  # noqa: E402

from chefbot.demo.processes import cpu_seconds  # noqa: E402
from chefbot.msgs.chefbot_msgs import WheelSpeeds  # noqa: E402
from chefbot.ros2.rmw.node import RmwNode  # noqa: E402
from chefbot.ui.access.client_slots import ESTABLISHED_TIME  # noqa: E402
from chefbot.ui.access.visitors import ENGINEER, TokenKey  # noqa: E402

SECRET = "a secret for this measurement only"
COOKIE = f"chefbot={TokenKey(SECRET).token(ENGINEER)}"
PATIENCE = 180.0
ENTRY_PATIENCE = 20.0
"""Time after which a new operator counts as locked out, s."""
LAUNCH = """
clock: wall
include: [base]
nodes:
  static_map_to_odom: {kind: "chefbot.nodes.static_transform:StaticTransformNode", params: {frame: map, child: odom}}
  page: {kind: "chefbot.ui.web_ui:WebUiDevice", %s params: {port: %d}}
"""


# -- attacks: each runs in a process of its own until it is ended


def slow_headers(host: str, port: int) -> None:
    """Hold 80 connections and send a byte of a header on each twice a second."""
    held: list[socket.socket] = []
    while True:
        for one in list(held):
            try:
                one.send(b"X")
            except OSError:
                held.remove(one)
        while len(held) < 80:
            with suppress(OSError):
                one = socket.create_connection((host, port), timeout=2.0)
                one.send(b"GET / HTTP/1.1\r\nX-Slow: ")
                held.append(one)
        time.sleep(0.5)


def http_flood(host: str, port: int, cookie: str = "") -> None:
    """Request the web UI as fast as possible, each time on a new connection."""
    headers = f"Host: {host}:{port}\r\n" + (f"Cookie: {cookie}\r\n" if cookie else "")
    request = f"GET / HTTP/1.1\r\n{headers}\r\n".encode()
    while True:
        with suppress(OSError), socket.create_connection((host, port), timeout=2.0) as one:
            one.sendall(request)
            one.recv(4096)


def http_flood_with_token(host: str, port: int) -> None:
    """The same with a valid token."""
    http_flood(host, port, COOKIE)


def socket_flood_with_token(host: str, port: int) -> None:
    """Open 40 web sockets with a valid token and send commands on each as fast as possible."""

    async def one() -> None:
        while True:
            with suppress(Exception):
                url, headers = f"ws://{host}:{port}/live", {"Cookie": COOKIE}
                async with connect_async(url, additional_headers=headers, max_size=None) as web:
                    while True:
                        await web.send('{"do":"cancel"}')
            await asyncio.sleep(0.05)

    async def all_of_them() -> None:
        await asyncio.gather(*(one() for _ in range(40)))

    asyncio.run(all_of_them())


def socket_flood(host: str, port: int) -> None:
    """Ask for web sockets without a token as fast as possible."""
    key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
    request = f"GET /live HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n{key}\r\n"
    while True:
        with suppress(OSError), socket.create_connection((host, port), timeout=2.0) as one:
            one.sendall(request.encode())
            one.recv(4096)


def sockets_that_never_read(host: str, port: int) -> None:
    """Hold 30 web sockets with a valid token and read nothing from them."""
    key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
    upgrade = f"Upgrade: websocket\r\nConnection: Upgrade\r\nCookie: {COOKIE}\r\n{key}"
    held: list[socket.socket] = []
    while True:
        if len(held) >= 30:
            held.pop(0).close()
        with suppress(OSError):
            one = socket.create_connection((host, port), timeout=2.0)
            one.sendall(f"GET /live HTTP/1.1\r\nHost: {host}\r\n{upgrade}\r\n".encode())
            held.append(one)
        time.sleep(0.1)


ATTACKS: dict[str, tuple[Callable[[str, int], None] | None, int]] = {
    "none": (None, 0),
    "80 slow headers": (slow_headers, 1),
    "HTTP, no token": (http_flood, 2),
    "HTTP, token": (http_flood_with_token, 2),
    "web sockets, no token": (socket_flood, 2),
    "web sockets, token": (socket_flood_with_token, 1),
    "sockets never read": (sockets_that_never_read, 1),
}


@contextmanager
def attack(name: str, host: str, port: int) -> Iterator[None]:
    """Run an attack."""
    run, count = ATTACKS[name]
    attackers = [multiprocessing.Process(target=run, args=(host, port), daemon=True) for _ in range(count)]
    for one in attackers:
        one.start()
    try:
        yield
    finally:
        for one in attackers:
            one.kill()
            one.join()


# -- figures


class Operator:
    """A browser that is connected before the attack; it reads, and pings as the web UI does."""

    def __init__(self, host: str, port: int) -> None:
        self._stack = ExitStack()
        self._browser = self._stack.enter_context(_open_at_last(host, port))
        self._presses = 0
        self._stop: dict[str, Any] = {"confirmed": [], "stopped": False}
        self._changed = threading.Condition()
        self._closed = threading.Event()
        self._threads = [threading.Thread(target=job, daemon=True) for job in (self._ping, self._read)]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Disconnect."""
        self._closed.set()
        self._stack.close()
        for thread in self._threads:
            thread.join()

    def stop_and_resume(self) -> float:
        """Press STOP and return the seconds until the base has confirmed this press; release it."""
        self._presses += 1
        key = f"bench-{self._presses}-{time.monotonic_ns()}"
        began = time.monotonic()
        self._browser.send(json.dumps({"do": "stop", "id": key}))
        self._await(lambda stop: key in stop["confirmed"])
        took = time.monotonic() - began
        self._browser.send('{"do":"release_stop"}')
        self._await(lambda stop: not stop["stopped"])
        return took

    def _await(self, found: Callable[[dict[str, Any]], bool]) -> None:
        with self._changed:
            if not self._changed.wait_for(lambda: self._closed.is_set() or found(self._stop), PATIENCE):
                raise TimeoutError
        if self._closed.is_set():
            raise ConnectionError("the operator was disconnected")

    def _ping(self) -> None:
        number = 0
        while not self._closed.wait(0.25):
            number += 1
            with suppress(ConnectionClosed):
                self._browser.send(json.dumps({"do": "ping", "n": number}))

    def _read(self) -> None:
        with suppress(ConnectionClosed):
            for data in self._browser:
                message = json.loads(data) if isinstance(data, str) else {}
                if message.get("layer") == "stop":
                    with self._changed:
                        self._stop = message["value"]
                        self._changed.notify_all()
        with self._changed:
            self._closed.set()
            self._changed.notify_all()


def _open(host: str, port: int) -> AbstractContextManager[ClientConnection]:
    url = f"ws://{host}:{port}/live"
    return connect(url, additional_headers={"Cookie": COOKIE}, open_timeout=10.0, max_size=None)


def _open_at_last(host: str, port: int) -> AbstractContextManager[ClientConnection]:
    """Connect, again if refused: the limits of the last attack may still hold."""
    began = time.monotonic()
    while True:
        try:
            return _open(host, port)
        except Exception:
            if time.monotonic() - began > PATIENCE:
                raise
            time.sleep(0.2)


def new_operator(host: str, port: int) -> float | None:
    """Return the seconds until a new browser with a token has the web UI and a first layer; None if locked out."""
    began = time.monotonic()
    while time.monotonic() - began < ENTRY_PATIENCE:
        with suppress(OSError, TimeoutError, Exception):
            request = urllib.request.Request(f"http://{host}:{port}/", headers={"Cookie": COOKIE})
            with urllib.request.urlopen(request, timeout=5.0) as page:
                assert b"STOP" in page.read()
            with _open(host, port) as browser:
                browser.recv(timeout=5.0)
                return time.monotonic() - began
        time.sleep(0.1)
    return None


def percentile(values: Sequence[float] | NDArray[np.float64], share: float) -> float:
    """Return a percentile in ms."""
    return float(1e3 * np.percentile(values, share)) if len(values) else float("nan")


def own_address() -> str:
    """Return another address of this computer than loopback, as if the operator were another computer."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.connect(("192.0.2.1", 9))
        return str(udp.getsockname()[0])


def measure(name: str, launch: LaunchProcess, node: RmwNode, address: tuple[str, int], seconds: float) -> str:
    """Return a row of the table."""
    elsewhere = (own_address(), address[1])
    operator = Operator(*elsewhere)
    time.sleep(ESTABLISHED_TIME)
    stamps: list[float] = []
    subscription = node.subscription("/wheel_speeds", WheelSpeeds, lambda _: stamps.append(time.monotonic()))
    pids = [launch.process.pid, *children_of(launch.process.pid)]
    with attack(name, *address):
        time.sleep(1.0)
        stamps.clear()
        before = {pid: cpu_seconds(pid) or 0.0 for pid in pids}
        began, stops = time.monotonic(), list[float]()
        entered = [new_operator(*place) for place in (elsewhere, address)]
        pressed_from = time.monotonic()
        while time.monotonic() - pressed_from < seconds:
            stops.append(operator.stop_and_resume())
            time.sleep(0.2)
        wall = time.monotonic() - began
        gaps = np.diff(stamps)
        used = {pid: ((cpu_seconds(pid) or 0.0) - before[pid]) / wall for pid in pids}
    node.destroy(subscription)
    operator.close()
    # STOP publishes commands at once, between those of the period: the longest gap is what counts
    rate = len(gaps) / (stamps[-1] - stamps[0]) if len(gaps) else 0.0
    page, base = used.get(launch.child("page") or 0, float("nan")), used[launch.process.pid]
    entries = " ".join("   no" if took is None else f"{took:5.2f}" for took in entered)
    of_gaps = f"{percentile(gaps, 99):6.0f} {percentile(gaps, 100):6.0f}"
    of_stops = f"{percentile(stops, 50):6.0f} {percentile(stops, 100):6.0f}"
    return f"{name:23} {rate:5.1f} {of_gaps}   {of_stops}   {entries}   {page:5.2f} {base:5.2f}"


def main() -> None:
    """Print the table. `other`, `same`: a new operator at another address than the attacker, or at the same."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    os.environ["CHEFBOT_PAGE_SECRET"] = SECRET
    host = "127.0.0.1"
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CHEFBOT_STATE"] = folder
        with socket.create_server((host, 0)) as probe:
            port = probe.getsockname()[1]
        file = Path(folder, "flooded.yaml")
        file.write_text(LAUNCH % ("" if "in_base" in sys.argv else "process: page,", port))
        with run_chefbot("launch", str(file), "page.host:=0.0.0.0") as (launch, node):
            wait_for(lambda: _serves(host, port), PATIENCE)
            time.sleep(5.0)
            print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
            print("                       base Hz  gap p99 worst  STOP ms  worst   operator s   page  base")
            print("                                      ms    ms                 other  same       cores")
            for name in ATTACKS:
                print(measure(name, launch, node, (host, port), seconds), flush=True)
            lost = re.findall(r"process page .*", launch.stop())
            print(f"notices about the web UI's process: {lost or 'none'}")


def _serves(host: str, port: int) -> bool:
    with suppress(OSError), socket.create_connection((host, port), timeout=1.0):
        return urlsplit(f"http://{host}:{port}").port == port
    return False


if __name__ == "__main__":
    main()
