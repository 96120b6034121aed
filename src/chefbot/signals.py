"""Ctrl-C and `kill` as the orderly end of a run."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def stop_on_signals(stop: Callable[[], None], *, last: bool = False) -> Iterator[None]:
    """Ctrl-C and `kill` end a run in order: motors still, files whole.

    `last`: the program ends with this run. A second signal, as `ros2 launch` sends one, must not break off the end.
    """
    asked = threading.Event()

    def obey(*_: object) -> None:
        asked.set()
        stop()

    old = {name: signal.signal(name, obey) for name in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for name, handler in old.items():
            signal.signal(name, signal.SIG_IGN if last and asked.is_set() else handler)
