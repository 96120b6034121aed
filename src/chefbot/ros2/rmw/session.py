"""The Zenoh session of this process, and a router when the machine has none yet.

Each process tries to become the router of its machine; the first to bind the port does (a running rmw_zenohd
counts), the others are peers that discover each other through it and then communicate directly. When the
router's process dies, another one takes over within a fraction of a second.
"""

from __future__ import annotations

import json
import os
import threading
import time
from itertools import count
from typing import Any

import zenoh

from chefbot.ros2.rmw.errors import ErrorCounter, SessionError
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.malloc_tuning import tune_malloc

PORT = 7447
"""Port on which rmw_zenoh expects its router."""
LOOPBACK = "127.0.0.1"
ROUTER_CHECK_PERIOD = 0.2
"""Seconds between two checks for a router."""
ROUTER_WAIT = 0.1
"""Maximum time that opening waits for a router, s; afterwards the search goes on in the background."""
MAX_DOMAIN = 232
CONGESTION_TIMEOUT_US = 1_000_000
"""Time after which a peer that accepts no data is disconnected, us. With Zenoh's default of 5 s, a subscriber
that dies while it receives a large map blocks the publisher towards all others for that time."""

ZENOH_RUNTIME_CONFIG = "(rx: (worker_threads: 1))"
"""Zenoh's default of two receiving threads wake each other for every message; with one, a scan takes half the
time and half the CPU (docs/why.md). ZENOH_RUNTIME in the environment takes precedence."""


class RmwContext:
    """A Zenoh session and the ROS graph of its domain.

    With `router` it becomes the router when there is none; short-lived programs should not. Raises SessionError
    when the session cannot be opened.
    """

    def __init__(self, domain: int = 0, *, port: int = PORT, router: bool = True) -> None:
        if not 0 <= domain <= MAX_DOMAIN:
            raise SessionError(f"ROS domain {domain} must lie between 0 and {MAX_DOMAIN}")
        tune_malloc()
        self.domain = domain
        self.rejected = ErrorCounter()
        """Counts of received data that was not a valid message of its type, by reason; for diagnostics."""
        self._port = port
        self._numbers = count()
        self._closing = threading.Event()
        self._may_route = router
        # The router is opened first, so that this process's own session can connect to it
        self._router = _open_router(port) if router else None
        self.session = _open_peer(port)
        self._await_router()
        self.zid = str(self.session.zid())
        self.graph = Graph(self.session, domain, self.rejected)
        self._watcher = threading.Thread(target=self._watch, name="router watchdog")
        self._watcher.start()

    @property
    def is_router(self) -> bool:
        """Return whether this process is the router of its machine."""
        return self._router is not None

    @property
    def connected(self) -> bool:
        """Return whether there is a router, in this or another process."""
        return bool(self.session.info.routers_zid())

    def next_id(self) -> str:
        """Return the next id for a node or endpoint of this session, counting from 0."""
        return str(next(self._numbers))

    def close(self) -> None:
        """Close the session and the router, and free the port."""
        self._closing.set()
        if threading.current_thread() is not self._watcher:
            self._watcher.join()
        self.graph.close()
        self.session.close()
        if self._router is not None:
            self._router.close()
            self._router = None

    def __enter__(self) -> RmwContext:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _await_router(self) -> None:
        """Wait briefly for a router.

        Zenoh connects in the background and retries forever; a running router replies within milliseconds.
        """
        deadline = time.monotonic() + ROUTER_WAIT
        while not self.connected and time.monotonic() < deadline:
            time.sleep(0.001)

    def _watch(self) -> None:
        """Become the router when there is none; close the session when the main thread has ended.

        Zenoh's threads would keep the process alive forever, and `atexit` runs only after them.
        """
        while not self._closing.wait(ROUTER_CHECK_PERIOD):
            if not threading.main_thread().is_alive():
                self.close()
                return
            if self._may_route and self._router is None and not self.connected:
                self._router = _open_router(self._port)


def _open_router(port: int) -> zenoh.Session | None:
    """Open a router on loopback; return None when the port is taken, because then another router runs."""
    config = {**_common(), "mode": "router", "listen": {"endpoints": [f"tcp/{LOOPBACK}:{port}"]}}
    try:
        return _open(config)
    except zenoh.ZError as error:
        if "in use" in str(error):
            return None
        raise SessionError(
            f"the Zenoh router port {LOOPBACK}:{port} cannot be opened: {_short(error)}"
        ) from None


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
        raise SessionError(f"the Zenoh session cannot be opened: {_short(error)}") from None


def _common() -> dict[str, Any]:
    """Return the configuration of rmw_zenoh, but without its scouting delay of half a second."""
    return {
        "scouting": {"delay": 0, "multicast": {"enabled": False}, "gossip": {"enabled": True}},
        "timestamping": {"enabled": True},
        "transport": {
            "shared_memory": {"enabled": False},
            "link": {
                "tx": {
                    "queue": {"congestion_control": {"block": {"wait_before_close": CONGESTION_TIMEOUT_US}}}
                }
            },
        },
    }


def _open(config: dict[str, Any]) -> zenoh.Session:
    os.environ.setdefault(
        "ZENOH_RUNTIME", ZENOH_RUNTIME_CONFIG
    )  # read by Zenoh when it opens its first session
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


def _short(error: zenoh.ZError) -> str:
    """Return the error text without the library's own file names."""
    return str(error).partition(" at /")[0]
