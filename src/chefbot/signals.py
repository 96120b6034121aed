"""Orderly shutdown on SIGINT (Ctrl-C) and SIGTERM (`kill`)."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INTERRUPTED = 130
"""Exit code of a command that Ctrl-C has ended: 128 and the number of SIGINT."""


@contextmanager
def stop_on_signals(
    stop: Callable[[], None], *, last: bool = False, notice: str = ""
) -> Iterator[threading.Event]:
    """Call `stop` on SIGINT and SIGTERM, so that motors stop and files are completed.

    Yields the event of a received signal. `last`: the program ends with this run, so later signals are ignored
    during the shutdown; `ros2 launch` sends a second one. `notice`: written at once to standard error, as the
    shutdown may take seconds.
    """
    received = threading.Event()

    def handle(*_: object) -> None:
        if notice and not received.is_set():
            # Not by print: the signal may have interrupted one.
            os.write(sys.stderr.fileno(), f"\n{notice}\n".encode())
        received.set()
        stop()

    previous = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        for number, handler in previous.items():
            signal.signal(number, signal.SIG_IGN if last and received.is_set() else handler)
