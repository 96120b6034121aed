"""Orderly shutdown on SIGINT (Ctrl-C) and SIGTERM (`kill`)."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def stop_on_signals(stop: Callable[[], None], *, last: bool = False) -> Iterator[None]:
    """Call `stop` on SIGINT and SIGTERM, so that motors stop and files are completed.

    `last`: the program ends with this run, so later signals are ignored during the shutdown; `ros2 launch`
    sends a second one.
    """
    received = threading.Event()

    def handle(*_: object) -> None:
        received.set()
        stop()

    previous = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, signal.SIG_IGN if last and received.is_set() else handler)
