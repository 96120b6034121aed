"""A place on the wire: this process's Zenoh session, and a router when the machine has none yet.

Each process tries to be the router of its machine; one wins the port (a running rmw_zenohd counts), the others
are peers that find each other through it and then talk directly. When the router's process dies, another one
takes its place within a fraction of a second.
"""

from __future__ import annotations

import json
import os
import threading
import time
from itertools import count
from typing import Any

import zenoh

from chefbot.errors import UserError
from chefbot.ros2.rmw.errors import Tally
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.malloc_tuning import keep_memory

PORT = 7447
"""Where rmw_zenoh looks for its router."""
LOOPBACK = "127.0.0.1"
WATCH_PERIOD = 0.2
"""Seconds between two looks whether there is a router."""
ROUTER_WAIT = 0.1
"""Seconds that opening waits for a router at most; without one it goes on looking in the background."""
MAX_DOMAIN = 232
STUCK_US = 1_000_000
"""A peer that takes nothing for so long is cut off. With Zenoh's 5 s a listener that dies while it is sent a large
map keeps the sender from everybody else for that time."""

THREADS = "(rx: (worker_threads: 1))"
"""Zenoh's default of two receiving threads wake each other for every message: with one, a scan takes half the time
and half the processor (docs/why.md). The environment's own ZENOH_RUNTIME goes before."""


class Wire:
    """One Zenoh session and what is known of the others in its ROS domain.

    `router`: take the router's place when nobody has it; programs that stay a moment only should not.
    UserError when the wire cannot be opened at all.
    """

    def __init__(self, domain: int = 0, *, port: int = PORT, router: bool = True) -> None:
        if not 0 <= domain <= MAX_DOMAIN:
            raise UserError(f"ROS domain {domain} must lie between 0 and {MAX_DOMAIN}")
        keep_memory()
        self.domain = domain
        self.refused = Tally()
        """What came in and was no message of its type, by reason; for diagnostics."""
        self._port = port
        self._numbers = count()
        self._closing = threading.Event()
        self._may_route = router
        self._router = _open_router(port) if router else None
        self.session = _open_peer(port)
        self._await_router()
        self.zid = str(self.session.zid())
        self.graph = Graph(self.session, domain, self.refused)
        self._watcher = threading.Thread(target=self._watch, name="wire watcher")
        self._watcher.start()

    @property
    def is_router(self) -> bool:
        """Whether this process is the router of its machine."""
        return self._router is not None

    @property
    def connected(self) -> bool:
        """Whether there is a router, ours or another."""
        return bool(self.session.info.routers_zid())

    def next_id(self) -> str:
        """Nodes and their ends are numbered through, from 0."""
        return str(next(self._numbers))

    def close(self) -> None:
        """Say goodbye to all and free the port."""
        self._closing.set()
        if threading.current_thread() is not self._watcher:
            self._watcher.join()
        self.graph.close()
        self.session.close()
        if self._router is not None:
            self._router.close()
            self._router = None

    def __enter__(self) -> Wire:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _await_router(self) -> None:
        """Zenoh connects behind our back and tries for ever; a router that is there answers in milliseconds."""
        until = time.monotonic() + ROUTER_WAIT
        while not self.connected and time.monotonic() < until:
            time.sleep(0.001)

    def _watch(self) -> None:
        """Take the router's place when it is empty; close what a program that ends has left open.

        Zenoh's threads would keep it alive for ever, and `atexit` comes after them.
        """
        while not self._closing.wait(WATCH_PERIOD):
            if not threading.main_thread().is_alive():
                self.close()
                return
            if self._may_route and self._router is None and not self.connected:
                self._router = _open_router(self._port)


def _open_router(port: int) -> zenoh.Session | None:
    """A router on loopback, None when the port is taken: then somebody else is it."""
    config = {**_common(), "mode": "router", "listen": {"endpoints": [f"tcp/{LOOPBACK}:{port}"]}}
    try:
        return _open(config)
    except zenoh.ZError as error:
        if "in use" in str(error):
            return None
        raise UserError(f"the wire's port {LOOPBACK}:{port} cannot be opened: {_short(error)}") from None


def _open_peer(port: int) -> zenoh.Session:
    retry = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2}
    config = {
        **_common(),
        "mode": "peer",
        "listen": {"endpoints": [f"tcp/{LOOPBACK}:0"]},
        "connect": {
            "endpoints": [f"tcp/{LOOPBACK}:{port}"],
            "timeout_ms": -1,
            "exit_on_failure": False,
            "retry": retry,
        },
    }
    try:
        return _open(config)
    except zenoh.ZError as error:
        raise UserError(f"the wire cannot be opened: {_short(error)}") from None


def _common() -> dict[str, Any]:
    """As rmw_zenoh's own configuration has it, but without its half second of scouting."""
    return {
        "scouting": {"delay": 0, "multicast": {"enabled": False}, "gossip": {"enabled": True}},
        "timestamping": {"enabled": True},
        "transport": {
            "shared_memory": {"enabled": False},
            "link": {"tx": {"queue": {"congestion_control": {"block": {"wait_before_close": STUCK_US}}}}},
        },
    }


def _open(config: dict[str, Any]) -> zenoh.Session:
    os.environ.setdefault("ZENOH_RUNTIME", THREADS)  # read by Zenoh when it opens its first session
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


def _short(error: zenoh.ZError) -> str:
    """Without the library's own file names."""
    return str(error).partition(" at /")[0]
